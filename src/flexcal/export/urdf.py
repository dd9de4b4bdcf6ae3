"""A calibrated URDF: joint origins and the tool moved to where they were found to be, links with the inertials that were found."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.atomic import write_text
from flexcal.errors import FlexcalError
from flexcal.export.urdf_inertials import write_inertials
from flexcal.model import RobotModel, point_kinematics, static_equilibrium
from flexcal.model.placement import link_placement, point_placement
from flexcal.model.rotations import rotation_rpy, rpy_rotation
from flexcal.units import MILLIMETRE

_SAMPLES = 2000


@dataclass(frozen=True)
class UrdfExport:
    """What was written, and what a URDF cannot say: `lost` terms and the tool error that leaving them out makes (m).

    `bodiless` links were identified with inertials that no body has, and kept those of the nominal URDF; with `drives` rotor inertia or
    friction was identified, which stay in estimates.yaml.
    """

    path: Path
    lost: tuple[str, ...]
    mean_loss: float
    max_loss: float
    bodiless: tuple[str, ...] = ()
    drives: bool = False

    def __str__(self) -> str:
        return " ".join([f"{self.path}: {self._kinematics()}", *self.remarks])

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence for each thing of the dynamics that the file lacks."""
        found = []
        if self.bodiless:
            found.append(
                f"No body can have the inertials identified for {', '.join(self.bodiless)}, which stay nominal; identify dynamics "
                "with --estimator sdp."
            )
        if self.drives:
            found.append(
                "Rotor inertia, friction and torque offset of the drives stay in estimates.yaml: torques need them besides."
            )
        return tuple(found)

    def _kinematics(self) -> str:
        if not self.lost:
            return "nothing is lost; forward kinematics agree to rounding."
        return (
            f"a URDF cannot carry {', '.join(self.lost)}; without them the tool is off by "
            f"{self.mean_loss / MILLIMETRE:.3f} mm on average and {self.max_loss / MILLIMETRE:.3f} mm at most over the joint range."
        )


def write_urdf(model: RobotModel, path: str | Path, *, rng: np.random.Generator | None = None) -> UrdfExport:
    """Write the URDF of `model` with its geometric errors in the joint origins, its inertials, and a link a point of `points:` there.

    The point links are named after the points. Offsets, misalignments and lengths (Eqs. 15-17) fit a URDF exactly; deflection, backlash
    and transmission errors do not, and what leaving them out costs is measured on random poses and returned. Raises `FlexcalError` where
    a point's name is already a link's, or the file cannot be written.
    """
    path = Path(path)
    tree = ET.parse(model.urdf, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))
    root = tree.getroot()
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    for i, joint in enumerate(model.joints):
        position, rotation = link_placement(model, i)
        if (position != joint.translation).any() or (rotation != joint.rotation).any():
            shift = joint.rotation.T @ (position - joint.translation)
            _move(joints[joint.name], shift, joint.rotation.T @ rotation)
    bodiless = write_inertials(model, root)
    _add_points(model, root)
    ET.indent(tree)
    text = ET.tostring(root, encoding="unicode", xml_declaration=False)
    write_text(path, '<?xml version="1.0"?>\n' + text + "\n")
    drives = any(f"{name}.rotor_inertia" in model.posterior.parameters for name in model.joint_names)
    lost, mean, most = _measure_loss(model, np.random.default_rng(0) if rng is None else rng)
    return UrdfExport(path, lost, mean, most, bodiless, drives)


def _move(joint: ET.Element, shift: np.ndarray, turn: np.ndarray) -> None:
    """Append Trans(shift) · turn to a joint's origin."""
    origin = joint.find("origin")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    xyz = np.array([float(v) for v in origin.get("xyz", "0 0 0").split()])
    rotation = rpy_rotation(np.array([float(v) for v in origin.get("rpy", "0 0 0").split()]))
    _place(origin, xyz + rotation @ shift, rotation @ turn)


def _place(origin: ET.Element, xyz: np.ndarray, rotation: np.ndarray) -> None:
    origin.set("xyz", " ".join(repr(float(v)) for v in xyz))
    origin.set("rpy", " ".join(repr(float(v)) for v in rotation_rpy(rotation)))


def _add_points(model: RobotModel, root: ET.Element) -> None:
    links = {link.get("name") for link in root.findall("link")}
    for name in model.points:
        if name in links:
            raise FlexcalError(
                f"the point '{name}' has the name of a link of {model.urdf.name}; rename it under `points:`."
            )
        carrier, position, rotation = point_placement(model, name)
        ET.SubElement(root, "link", name=name)
        joint = ET.SubElement(root, "joint", name=f"{name}_point", type="fixed")
        _place(ET.SubElement(joint, "origin"), position, rotation)
        ET.SubElement(joint, "parent", link=model.joints[carrier].link)
        ET.SubElement(joint, "child", link=name)


def _measure_loss(model: RobotModel, rng: np.random.Generator) -> tuple[tuple[str, ...], float, float]:
    """What a URDF cannot carry, and how far the tool is then off, m: on average and at most."""
    lost = tuple(
        name
        for name, present in (
            ("elastic deflection", bool(model.elastic)),
            ("backlash", model.backlash.any()),
            ("gravity compliance", model.gravity_compliance.any()),
            ("transmission error", model.transmission.any()),
        )
        if present
    )
    if not lost or not model.points:
        return lost, 0.0, 0.0
    lower = [max(joint.lower, -np.pi) for joint in model.joints]
    upper = [min(joint.upper, np.pi) for joint in model.joints]
    q = rng.uniform(lower, upper, (_SAMPLES, model.n))
    bent = point_kinematics(model, q, static_equilibrium(model, q).deflection, jacobians=False).position
    straight = point_kinematics(model, q, jacobians=False).position
    distance = np.linalg.norm(bent - straight, axis=1)
    return lost, float(distance.mean()), float(distance.max())
