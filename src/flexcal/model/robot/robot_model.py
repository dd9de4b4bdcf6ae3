"""The robot model: nominal from robot.yaml and URDF, updated by estimates."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_yaml_file
from flexcal.files.structuring import suggestion
from flexcal.files.transaction import current_path
from flexcal.kernels import Tree
from flexcal.model.parts import (
    Bearings,
    ElasticJoint,
    ForceSensor,
    Inertia,
    Joint,
    Payload,
    Point,
    Relations,
    bearing_frame,
    branching_joints,
    joints_that_move,
    kinematic_tree,
    parallel_axis,
    path_to,
)
from flexcal.model.robot.arm_sensor import ArmSensor
from flexcal.model.robot.config import ControllerConfig, RobotConfig
from flexcal.model.robot.drive_config import PriorConfig
from flexcal.model.robot.parameter_groups import (
    Drives,
    Geometry,
    Group,
    Lenses,
    Links,
    Location,
    Scatter,
    Springs,
    Stations,
    Thermal,
)
from flexcal.model.robot.parameter_names import GEOMETRY, ORIGIN, parameter_locations
from flexcal.model.robot.posterior import NOTHING_ESTIMATED, Posterior

_MOMENTS = {"Ixx": (0, 0), "Ixy": (0, 1), "Ixz": (0, 2), "Iyy": (1, 1), "Iyz": (1, 2), "Izz": (2, 2)}
_FIRST_MOMENTS = {"mc_x": 0, "mc_y": 1, "mc_z": 2}


@dataclass(frozen=True, eq=False)
class RobotModel:
    """Immutable robot of n motors: structure of the URDF, settings of robot.yaml, and parameters in groups of arrays, SI units.

    Every number that can be identified has a name (docs/file-formats.md): `values` reads them all, `with_values` makes a changed robot.
    Setting a link's or the payload's mass scales its inertia about the centre of mass with it; setting a link's `com_x`… or first
    moment `mc_x`… (mass times centre of mass, after the mass) moves that inertia rigidly.

    Attributes
    ----------
    config : RobotConfig
        Settings of robot.yaml.
    path, urdf : Path
        The files robot.yaml and URDF.
    name : str
        Name of the robot in the URDF.
    joints : tuple of Joint
        The movable joints, nominal.
    points : mapping of Point
        Target points by name.
    geometry : Geometry
        Deviations from the URDF, and compliances.
    springs : Springs
        Springs and dampers of the elastic joints.
    drives : Drives
        Motors, transmissions and friction.
    links : Links
        Masses and inertia.
    stations : Stations
        Places of the instrument.
    scatter : Scatter
        Standard deviations of instrument, robot and model error.
    thermal : Thermal
        Expansion and drift with temperature.
    payload : Payload or None
        The declared payload.
    force_sensor : ForceSensor or None
        The declared force sensor.
    posterior : Posterior
        Joint covariance of the parameters that were estimated.
    carriers : mapping of Point
        Nominal places of the instruments that the robot carries, by the name of the station.
    sensors : mapping of ArmSensor
        Sensors on the arm by name.
    lenses : Lenses
        Intrinsic parameters of cameras.
    relations : Relations or None
        How joints without a motor of their own follow the others; None where every joint has one.

    Examples
    --------
    >>> from flexcal import RobotModel
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> model.n
    6
    >>> model.value("joint_1.drive.stiffness")
    143700.0
    >>> stiffer = model.with_values({"joint_1.drive.stiffness": 150e3})
    >>> round(stiffer.value("joint_1.drive.stiffness"))
    150000
    """

    config: RobotConfig
    path: Path
    urdf: Path
    name: str
    joints: tuple[Joint, ...]
    points: Mapping[str, Point]
    geometry: Geometry
    springs: Springs
    drives: Drives
    links: Links
    stations: Stations
    scatter: Scatter
    thermal: Thermal
    payload: Payload | None
    force_sensor: ForceSensor | None
    posterior: Posterior = NOTHING_ESTIMATED
    carriers: Mapping[str, Point] = field(default_factory=dict)
    sensors: Mapping[str, ArmSensor] = field(default_factory=dict)
    lenses: Lenses = field(default_factory=lambda: Lenses((), np.zeros((0, 9))))
    relations: Relations | None = None

    @classmethod
    def from_yaml(
        cls, path: str | Path, *, estimates: bool = True, without: Block | None = None
    ) -> RobotModel:
        """Read robot.yaml, its URDF and, where present, the estimates beside it.

        Parameters
        ----------
        path : str or Path
            The file robot.yaml.
        estimates : bool
            Whether the estimates beside it are read.
        without : str, optional
            Block of the estimates that is left out, such as "calibration".

        Returns
        -------
        RobotModel
            The robot.

        Raises
        ------
        InputError
            With file and line.
        """
        from flexcal.model.robot.loading import read_robot
        from flexcal.model.robot.stored_estimates import apply_estimates

        model = read_robot(cls, read_yaml_file(path))
        stored = model.estimates_file
        return (
            apply_estimates(model, stored, without=without)
            if estimates and current_path(stored).exists()
            else model
        )

    @property
    def estimates_file(self) -> Path:
        """The file of estimates that robot.yaml names, by default estimates.yaml beside it."""
        return self.path.parent / self.config.estimates

    def __getstate__(self) -> dict[str, Any]:
        """State for pickling, without what is derived from it."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def with_stations(self, names: Iterable[str]) -> RobotModel:
        """Robot with further stations, in the base frame: places of a fixture, which robot.yaml does not list.

        Parameters
        ----------
        names : iterable of str
            Names of stations; known ones stay as they are.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        more = [name for name in dict.fromkeys(names) if name not in self.stations.names]
        pose = np.concatenate([self.stations.pose, np.zeros((len(more), 6))])
        stations = replace(
            self.stations,
            names=(*self.stations.names, *more),
            pose=pose,
            zero=np.concatenate([self.stations.zero, np.zeros(len(more))]),
            wire_scale=np.concatenate([self.stations.wire_scale, np.zeros(len(more))]),
            drift=np.concatenate([self.stations.drift, np.zeros((len(more), 3))]),
        )
        return replace(self, stations=stations)

    def with_lenses(self, lenses: Mapping[str, np.ndarray]) -> RobotModel:
        """Robot with the intrinsic parameters of further cameras.

        Parameters
        ----------
        lenses : mapping of ndarray
            Values (9,) by name of the camera.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        more = {name: values for name, values in lenses.items() if name not in self.lenses.names}
        if not more:
            return self
        values = np.concatenate([self.lenses.values, np.array(list(more.values())).reshape(-1, 9)])
        return replace(self, lenses=Lenses((*self.lenses.names, *more), values))

    def with_bearings(self, bearings: Bearings) -> RobotModel:
        """Robot with bearing springs before or after the joint's rotation; parameters and posterior are kept.

        Parameters
        ----------
        bearings : {"before", "after"}
            Where the bearings tilt.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        return replace(self, config=replace(self.config, bearings=bearings))

    def with_priors(self, stds: Mapping[str, float]) -> RobotModel:
        """Robot with priors of some geometric parameters and stiffnesses, centred on their nominal values.

        Parameters
        ----------
        stds : mapping of float
            Standard deviations, m or rad, relative for a stiffness, by name of the parameter.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        prior = replace(self.config.prior, parameters={**self.config.prior.parameters, **stds})
        return replace(self, config=replace(self.config, prior=prior))

    def with_drive_springs(self, springs: Mapping[int, tuple[float, float]]) -> RobotModel:
        """Robot with drive springs at some of its rigid joints.

        In a frequency experiment the motors of these joints are braked.

        Parameters
        ----------
        springs : mapping
            Stiffness, N m/rad, and damping, N m s/rad, by index of the joint.

        Returns
        -------
        RobotModel
            The changed robot.

        Raises
        ------
        FlexcalError
            For a prismatic joint.
        """
        frames = dict(self.springs.bearing_frames)
        stiffness, damping = self.springs.stiffness.copy(), self.springs.damping.copy()
        for i, (constant, loss) in springs.items():
            joint = self.joints[i]
            if joint.kind != "revolute":
                raise FlexcalError(
                    "E-ROBOT-038",
                    f"the joint '{joint.name}' is prismatic; only revolute joints can be elastic.",
                )
            frames[i] = bearing_frame(joint)
            stiffness[i, 2], damping[i, 2] = constant, loss
        widened = replace(
            self.springs,
            bearing_frames=frames,
            stiffness=stiffness,
            damping=damping,
            braked=self.springs.braked | set(springs),
        )
        return replace(self, springs=widened)

    def without_springs(self) -> RobotModel:
        """Robot without elastic joints."""
        return replace(self, springs=replace(self.springs, bearing_frames={}))

    def with_estimated_springs(self, values: Mapping[str, float]) -> RobotModel:
        """Robot with a drive spring at every rigid joint whose `<joint>.drive.stiffness` was estimated.

        Parameters
        ----------
        values : mapping of float
            Estimated values by name.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        springs = {}
        for i, name in enumerate(self.joint_names):
            stiffness = values.get(f"{name}.drive.stiffness")
            if stiffness is not None and i not in self.springs.bearing_frames:
                springs[i] = (stiffness, values.get(f"{name}.drive.damping", 0.0))
        return self.with_drive_springs(springs) if springs else self

    def with_brakes(self, excited: tuple[str, ...]) -> RobotModel:
        """Robot in a frequency experiment: the motors of all elastic joints that are not excited are braked.

        Parameters
        ----------
        excited : tuple of str
            Names of the excited joints.

        Returns
        -------
        RobotModel
            The changed robot.
        """
        braked = frozenset(e.index for e in self.elastic if e.name not in excited)
        return replace(self, springs=replace(self.springs, braked=braked))

    @property
    def n(self) -> int:
        """Number of motors: the joints whose positions are commanded and measured, all of them where there are no relations."""
        return len(self.motors)

    @cached_property
    def motors(self) -> tuple[int, ...]:
        """Indices of the joints with motors."""
        return tuple(range(len(self.joints))) if self.relations is None else self.relations.motors

    @cached_property
    def motor_joints(self) -> tuple[Joint, ...]:
        """The joints with motors, in the order of the columns q1, q2, …"""
        return tuple(self.joints[i] for i in self.motors)

    @cached_property
    def motor_names(self) -> tuple[str, ...]:
        """URDF names of the joints with motors."""
        return tuple(joint.name for joint in self.motor_joints)

    @cached_property
    def joint_offsets(self) -> np.ndarray:
        """Offsets (N,) of all joints, with what the offsets of others make of them by linear relations, rad or m."""
        offsets = self.geometry.errors[:, 0]
        return offsets if self.relations is None else self.relations.carry @ offsets

    @cached_property
    def geometry_columns(self) -> Mapping[str, int]:
        """Names of the geometric errors that Jacobians have columns for, but those of the tool, with their places.

        Six of every joint; with loops those of their ends and the displacements of joints that branch off, which move the loops.
        """
        loops = () if self.relations is None else self.relations.loops
        names = [f"{joint}.{key}" for joint in self.joint_names for key in GEOMETRY]
        names += [f"loop.{loop.name}.{key}" for loop in loops for key in loop.errors]
        names += [f"{self.joint_names[i]}.{key}" for i in self.branching for key in ORIGIN if loops]
        return MappingProxyType({name: place for place, name in enumerate(names)})

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """URDF names of the movable joints."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def tree(self) -> Tree:
        """The kernels' view of joints and bearing frames."""
        frames = self.springs.bearing_frames
        return kinematic_tree(self.joints, frames, self.config.bearings, self.geometry.origin_error)

    @cached_property
    def branching(self) -> tuple[int, ...]:
        """Indices of the joints with a displacement of their own in the parent link, because another one places it."""
        return branching_joints(self.joints)

    @property
    def gravity(self) -> np.ndarray:
        """Gravity (3,) in the base frame, m/s²."""
        return np.array(self.config.gravity)

    @property
    def prior(self) -> PriorConfig:
        """Prior standard deviations of the nominal inertials."""
        return self.config.prior

    @property
    def controller(self) -> ControllerConfig | None:
        """Position controller, if declared."""
        return self.config.controller

    @property
    def bearings(self) -> Bearings:
        """Location of the bearing springs, before or after the joint's rotation; as in Eq. (1) if unknown."""
        return self.config.bearings or "after"

    @property
    def has_bearings(self) -> bool:
        """Whether any joint has bearing springs, so that their location matters."""
        return any(joint.bearings for joint in self.elastic)

    @property
    def backlash_joints(self) -> tuple[int, ...]:
        """Indices of the joints declared to have backlash."""
        return tuple(self.joint_index(name) for name in self.config.geometry.backlash)

    @cached_property
    def elastic(self) -> tuple[ElasticJoint, ...]:
        """Joints with springs, in chain order."""
        return tuple(
            ElasticJoint(
                i,
                self.joints[i].name,
                frame,
                self.springs.stiffness[i],
                self.springs.damping[i],
                bool(np.isfinite(self.springs.stiffness[i, 0])),
                self.bearings == "before",
            )
            for i, frame in sorted(self.springs.bearing_frames.items())
        )

    @cached_property
    def driven(self) -> tuple[ElasticJoint, ...]:
        """Elastic joints whose motors are excited in a frequency experiment, that is, not braked."""
        return tuple(joint for joint in self.elastic if joint.index not in self.springs.braked)

    @cached_property
    def inertias(self) -> tuple[Inertia, ...]:
        """Inertia of the link of every joint."""
        return tuple(
            Inertia(float(m), c, y)
            for m, c, y in zip(self.links.mass, self.links.com, self.links.inertia, strict=True)
        )

    @property
    def payload_mass(self) -> float:
        """Mass of the declared payload, kg; zero without one."""
        return 0.0 if self.payload is None else self.payload.mass

    @cached_property
    def reach(self) -> float:
        """Sum of the link lengths from the base to the farthest point, m."""
        lengths = [float(np.linalg.norm(joint.translation)) for joint in self.joints]
        far = [float(np.linalg.norm(p.translation) + np.linalg.norm(p.xyz)) for p in self.points.values()]
        return sum(lengths) + max(far, default=0.0)

    def joint_index(self, name: str) -> int:
        """Index of a joint.

        Parameters
        ----------
        name : str
            URDF name of the joint.

        Returns
        -------
        int
            Index from 0.

        Raises
        ------
        FlexcalError
            For an unknown name; lists the names.
        """
        if name not in self.joint_names:
            raise FlexcalError(
                "E-ROBOT-039",
                f"there is no movable joint '{name}' in {self.urdf.name}; there are {', '.join(self.joint_names)}.",
            )
        return self.joint_names.index(name)

    def path_to(self, joint: int) -> tuple[int, ...]:
        """Indices of the joints from the base to a joint.

        Parameters
        ----------
        joint : int
            Index of the last joint; -1 is the base.

        Returns
        -------
        tuple of int
            Indices, `joint` included; none for the base.
        """
        return path_to(self.joints, joint)

    def require_motors(self, purpose: str) -> None:
        """Refuse a robot with joints that follow others.

        Parameters
        ----------
        purpose : str
            What takes only robots without.

        Raises
        ------
        FlexcalError
            Where a joint has no motor of its own.
        """
        if self.relations is not None:
            other = next((joint.name for i, joint in enumerate(self.joints) if i not in self.motors), "")
            what = (
                f"'{other}' of {self.name} follows other joints"
                if other
                else f"motors of {self.name} are coupled"
            )
            raise FlexcalError(
                "E-ROBOT-076",
                f"{what}, and {purpose} can have only joints that move each by a motor of its own; calibrate, map, compensate, and export "
                "urdf, sdf, json and offsets take such a robot.",
            )

    def moving(self, joint: int) -> tuple[int, ...]:
        """Indices of the joints that move a joint's link: those from the base to it, and those that these follow.

        Parameters
        ----------
        joint : int
            Index of the joint.

        Returns
        -------
        tuple of int
            Indices, ascending.
        """
        return joints_that_move(self.joints, self.relations, joint)

    def point(self, name: str | None = None) -> Point:
        """Target point by name.

        Parameters
        ----------
        name : str, optional
            Name of the point; by default the first declared one.

        Returns
        -------
        Point
            The point.

        Raises
        ------
        FlexcalError
            For an unknown name; lists the names.
        """
        if not self.points:
            raise FlexcalError(
                "E-ROBOT-040",
                f"{self.path} declares no point; add one under `points:` so that there is something to measure.",
            )
        key = next(iter(self.points)) if name is None else name
        if key not in self.points:
            raise FlexcalError(
                "E-ROBOT-041",
                f"there is no point '{key}' under `points:` in {self.path}; there are {', '.join(self.points)}.",
            )
        return self.points[key]

    @property
    def tool_point(self) -> str:
        """Point whose place the errors `tool.length_x`, `_y`, `_z` are of: the first, of a calibrated robot that of its calibration."""
        return self.geometry.tool_point or next(iter(self.points))

    def station_index(self, name: str) -> int:
        """Index of a station of the instrument.

        Parameters
        ----------
        name : str
            Name of the station.

        Returns
        -------
        int
            Index from 0.

        Raises
        ------
        FlexcalError
            For an unknown name; lists the names.
        """
        if name not in self.stations.names:
            raise FlexcalError(
                "E-ROBOT-042",
                f"there is no station '{name}' in {self.path}, which has {', '.join(self.stations.names)}; declare it under `stations:`, "
                "and the others there too.",
            )
        return self.stations.names.index(name)

    def standing_station(self, name: str) -> np.ndarray:
        """Pose of an instrument that does not move with the robot.

        Parameters
        ----------
        name : str
            Name of the station.

        Returns
        -------
        ndarray
            Pose (6,): translation, m, and rotation vector, rad, from the base frame to the instrument's.

        Raises
        ------
        FlexcalError
            For an unknown name, and for an instrument that a frame of the robot carries.
        """
        if name in self.carriers:
            raise FlexcalError(
                "E-ROBOT-062",
                f"the station '{name}' moves with the robot's {self.carriers[name].frame}, so it gives no place in the base frame; use an "
                "instrument that stands still.",
            )
        return self.stations.pose[self.station_index(name)]

    @cached_property
    def _locations(self) -> dict[str, Location]:
        return parameter_locations(self)

    @cached_property
    def _payload_keys(self) -> dict[str, str]:
        return {} if self.payload is None else {f"payload.{key}": key for key in self.payload.values}

    @cached_property
    def _link_moments(self) -> dict[str, tuple[int, str]]:
        """Name → (link, key) of the inertia about the joint frame and of the first moments."""
        keys = (*_MOMENTS, *_FIRST_MOMENTS)
        return {f"{joint.link}.{key}": (i, key) for i, joint in enumerate(self.joints) for key in keys}

    @cached_property
    def values(self) -> Mapping[str, float]:
        """All named values, SI units."""
        table = {
            name: float(getattr(getattr(self, group), array)[index])
            for name, (group, array, index) in self._locations.items()
        }
        payload = {} if self.payload is None else self.payload.values
        table.update({name: payload[key] for name, key in self._payload_keys.items()})
        links = [_moments_at_joint(inertia) for inertia in self.inertias]
        table.update({name: links[i][key] for name, (i, key) in self._link_moments.items()})
        return MappingProxyType(table)

    def value(self, name: str) -> float:
        """Value of a named parameter.

        Parameters
        ----------
        name : str
            Name of the parameter, such as `link_3.mass`.

        Returns
        -------
        float
            Value, SI units.

        Raises
        ------
        FlexcalError
            For an unknown name; suggests close ones.
        """
        if name not in self.values:
            raise self._unknown(name)
        return self.values[name]

    def with_values(self, values: Mapping[str, float]) -> RobotModel:
        """Robot with new values of some named parameters.

        Parameters
        ----------
        values : mapping of float
            New values by name, SI units.

        Returns
        -------
        RobotModel
            The changed robot.

        Raises
        ------
        FlexcalError
            For an unknown name.
        """
        changes: dict[Group, dict[str, np.ndarray]] = {}

        def own(group: Group, array: str) -> np.ndarray:
            arrays = changes.setdefault(group, {})
            if array not in arrays:
                arrays[array] = getattr(getattr(self, group), array).copy()
            return arrays[array]

        moments: dict[int, dict[str, float]] = {}
        payload_values: dict[str, float] = {}
        for name, value in values.items():
            if name in self._locations:
                group, array, index = self._locations[name]
                own(group, array)[index] = value
                if group == "links" and array == "mass" and self.links.mass[index] > 0:
                    own("links", "inertia")[index] = self.links.inertia[index] * (
                        value / self.links.mass[index]
                    )
            elif name in self._payload_keys:
                payload_values[self._payload_keys[name]] = value
            elif name in self._link_moments:
                i, key = self._link_moments[name]
                moments.setdefault(i, {})[key] = value
            else:
                raise self._unknown(name)
        for i, entries in moments.items():
            mass, com, inertia = (own("links", array) for array in ("mass", "com", "inertia"))
            for key in _FIRST_MOMENTS.keys() & entries.keys():
                com[i, _FIRST_MOMENTS[key]] = self._com_of(i, entries.pop(key), mass[i])
            moved = parallel_axis(mass[i], com[i])
            at_joint = inertia[i] + moved
            for key, value in entries.items():
                row, column = _MOMENTS[key]
                at_joint[row, column] = at_joint[column, row] = value
            inertia[i] = at_joint - moved
        payload = self.payload
        if payload is not None and payload_values:
            payload = payload.with_values(payload_values)
        groups = {group: replace(getattr(self, group), **arrays) for group, arrays in changes.items()}
        return replace(self, payload=payload, **groups)

    def _unknown(self, name: str) -> FlexcalError:
        return FlexcalError(
            "E-ROBOT-043", f"unknown parameter '{name}'{suggestion(name, list(self.values), 3) or '.'}"
        )

    def _com_of(self, link: int, first_moment: float, mass: float) -> float:
        if mass == 0 and first_moment != 0:
            raise FlexcalError(
                "E-ROBOT-044",
                f"the link '{self.joints[link].link}' has no mass, so it can have no first moment.",
            )
        return first_moment / mass if mass != 0 else 0.0

    def with_estimate(self, estimate: Estimate) -> RobotModel:
        """Robot with those values of an estimate that belong to the robot itself, and with their joint covariance.

        A rigid joint whose drive stiffness was estimated gets that spring.

        Parameters
        ----------
        estimate : Estimate
            Estimated parameters.

        Returns
        -------
        RobotModel
            The changed robot.
        """

        widened = self.with_estimated_springs(estimate.values)
        own = tuple(name for name in estimate.parameters.names if name in widened.values)
        changed = widened.with_values({name: estimate.values[name] for name in own})
        return replace(changed, posterior=self.posterior.updated(estimate, own))


def _moments_at_joint(link: Inertia) -> dict[str, float]:
    """Inertia about the origin of the joint frame and first moments of a link."""
    at_joint = link.inertia + parallel_axis(link.mass, link.com)
    inertias = {key: float(at_joint[index]) for key, index in _MOMENTS.items()}
    return inertias | {key: float(link.mass * link.com[k]) for key, k in _FIRST_MOMENTS.items()}
