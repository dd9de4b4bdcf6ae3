"""A simulator that shares nothing with flexcal: a torso that carries two arms, every joint of which yields about all three axes.

The robot is a list of links in a tree. The URDF has every frame parallel to the base's with the joints at zero; poses are products of
exponentials in the base frame, and the deflection is the fixed point of "loads bend joints, bent joints move loads". A tracker sees one
reflector of each hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


def turn(vectors: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) of rotation vectors (..., 3), by Rodrigues."""
    v = np.asarray(vectors, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = np.zeros((*v.shape[:-1], 3, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    k = k - np.swapaxes(k, -1, -2)
    safe = np.where(angle > 1e-12, angle, 1.0)
    return np.eye(3) + np.sin(angle) / safe * k + (1 - np.cos(angle)) / safe**2 * (k @ k)


@dataclass
class Link:
    """A link behind a joint: name of the joint, index of the parent, axis and place of the joint (zero posture, base frame), m and kg."""

    name: str
    parent: int
    axis: tuple[float, float, float]
    origin: tuple[float, float, float]
    mass: float
    centre: tuple[float, float, float]
    stiffness: tuple[float, float, float]
    """N m/rad about the joint's axis, and about two axes across it that are fixed to the link before."""
    slides: bool = False


def torso_with_arms(
    rng: np.random.Generator, joints: int = 7, *, rail: bool = False, waist: bool = True
) -> list[Link]:
    """Yaw and pitch of a torso, and two arms; sizes of a light humanoid. Without a waist both arms stand on a column."""

    def springs(soft: float, across: float) -> tuple[float, float, float]:
        return tuple(soft * np.array([1.0, across, across]) * rng.uniform(0.7, 1.4, 3))

    links: list[Link] = []
    if rail:
        links.append(
            Link("rail", -1, (0, 1, 0), (0, 0, 0), 40.0, (0, 0, 0.1), (np.inf, np.inf, np.inf), True)
        )
    first = len(links) - 1
    if waist:
        yaw, pitch = springs(2.5e4, 1.5), springs(2e4, 2.0)
        links.append(Link("waist_yaw", first, (0, 0, 1), (0, 0, 0.6), 6.0, (0, 0, 0.7), yaw))
        links.append(Link("waist_pitch", first + 1, (0, 1, 0), (0, 0, 0.75), 14.0, (0.02, 0, 1.0), pitch))
    chest = len(links) - 1
    for side, sign in (("left", 1.0), ("right", -1.0)):
        y = 0.2 * sign
        shoulder = [
            ("shoulder_pitch", (0, 1, 0), (0, y, 1.2), 1.9, (0, y + 0.05 * sign, 1.2), 9e3),
            ("shoulder_roll", (1, 0, 0), (0, y + 0.06 * sign, 1.2), 1.5, (0, y + 0.06 * sign, 1.12), 8e3),
            ("shoulder_yaw", (0, 0, 1), (0, y + 0.06 * sign, 1.08), 1.3, (0, y + 0.06 * sign, 1.0), 7e3),
            ("elbow", (0, 1, 0), (0.02, y + 0.06 * sign, 0.93), 1.1, (0.03, y + 0.06 * sign, 0.85), 6e3),
            ("wrist_yaw", (0, 0, 1), (0, y + 0.06 * sign, 0.75), 0.8, (0, y + 0.06 * sign, 0.7), 4e3),
            ("wrist_pitch", (0, 1, 0), (0, y + 0.06 * sign, 0.66), 0.5, (0, y + 0.06 * sign, 0.64), 3e3),
            ("wrist_roll", (1, 0, 0), (0, y + 0.06 * sign, 0.62), 0.6, (0.01, y + 0.06 * sign, 0.55), 3e3),
        ][:joints]
        parent = chest
        for name, axis, origin, mass, centre, soft in shoulder:
            links.append(Link(f"{side}_{name}", parent, axis, origin, mass, centre, springs(soft, 1.5)))
            parent = len(links) - 1
    return links


@dataclass
class StrangerTorso:
    """A robot whose axes, zeros, lengths and masses are off, and whose joints yield; reflectors are fixed with a ruler."""

    seed: int = 0
    joints: int = 7
    rail: bool = False
    waist: bool = True
    yields: float = 1.0
    mass_error: float = 0.03
    jitter: float = 1e-5
    tracker_noise: float = 1.5e-5
    links: list[Link] = field(init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng([self.seed, 77])
        self.links = torso_with_arms(rng, self.joints, rail=self.rail, waist=self.waist)
        n = self.n = len(self.links)
        self.parent = [link.parent for link in self.links]
        self.axis = np.array([link.axis for link in self.links], dtype=float)
        self.origin = np.array([link.origin for link in self.links])
        self.centre = np.array([link.centre for link in self.links])
        self.mass = np.array([link.mass for link in self.links])
        self.tips = {}
        for side in ("left", "right"):
            last = max(i for i, link in enumerate(self.links) if link.name.startswith(side))
            # the hand is the last link, and the reflector stands out of it
            self.tips[side] = last
        self.hand = {side: self.origin[i] + np.array([0.0, 0.0, -0.1]) for side, i in self.tips.items()}
        self.declared_xyz = {"left": np.array([0.05, 0.02, -0.04]), "right": np.array([0.04, -0.03, -0.05])}
        slides = np.array([link.slides for link in self.links])
        tilts = turn(1e-3 * rng.normal(size=(n, 3)))
        self.true_axis = np.einsum("nij,nj->ni", tilts, self.axis)
        self.true_origin = self.origin + 4e-4 * rng.normal(size=(n, 3))
        self.zeros = np.where(slides, 0.0, 3e-3 * rng.normal(size=n))
        self.true_centre = self.centre + 3e-3 * rng.normal(size=(n, 3))
        self.true_mass = self.mass * (1 + self.mass_error * rng.normal(size=n))
        self.true_xyz = {side: xyz + 3e-3 * rng.normal(size=3) for side, xyz in self.declared_xyz.items()}
        stiffness = np.array([link.stiffness for link in self.links])
        self.compliance = self.yields / stiffness
        # the two axes across that of the joint, anyhow about it, in the housing
        across = np.cross(self.axis, [[1.0, 0.2, 0.3]])
        across /= np.linalg.norm(across, axis=1)[:, None]
        self.principal = np.stack([self.axis, across, np.cross(self.axis, across)], axis=1)
        self.tracker = turn(0.9 * rng.normal(size=3)), np.array([2.5, -1.0, 0.4]) + 0.3 * rng.normal(size=3)
        self.slides = slides

    def swept(
        self, q: np.ndarray, bend: np.ndarray, *, true: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rotation (N, n, 3, 3) and shift (N, n, 3) of every link from its zero posture, and the rotation of the link before each."""
        axis, origin = (self.true_axis, self.true_origin) if true else (self.axis, self.origin)
        at = q + (self.zeros if true else 0.0)
        rotation, shift = np.empty((len(q), self.n, 3, 3)), np.empty((len(q), self.n, 3))
        before = np.empty((len(q), self.n, 3, 3))
        for i, p in enumerate(self.parent):
            base = (
                (np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3)))
                if p < 0
                else (rotation[:, p], shift[:, p])
            )
            before[:, i] = base[0]
            if self.slides[i]:
                step, moved = np.broadcast_to(np.eye(3), (len(q), 3, 3)), at[:, i, None] * axis[i]
            else:
                step = turn(bend[:, i]) @ turn(at[:, i, None] * axis[i])
                moved = origin[i] - np.einsum("sij,j->si", step, origin[i])
            rotation[:, i] = base[0] @ step
            shift[:, i] = base[1] + np.einsum("sij,sj->si", base[0], moved)
        return rotation, shift, before

    def bent(self, q: np.ndarray) -> np.ndarray:
        """Deflection (N, n, 3), rad, of every joint in the axes of the housing before it, at rest under gravity."""
        bend = np.zeros((*q.shape, 3))
        weight = np.array([0.0, 0.0, -9.81])
        for _ in range(60):
            rotation, shift, before = self.swept(q, bend, true=True)
            centres = np.einsum("snij,nj->sni", rotation, self.true_centre) + shift
            pivots = np.einsum("snij,nj->sni", before, self.true_origin) + np.stack(
                [np.zeros((len(q), 3)) if p < 0 else shift[:, p] for p in self.parent], axis=1
            )
            mass = np.broadcast_to(self.true_mass, q.shape).copy()
            first = mass[:, :, None] * centres
            for i in range(self.n - 1, -1, -1):
                if self.parent[i] >= 0:
                    mass[:, self.parent[i]] += mass[:, i]
                    first[:, self.parent[i]] += first[:, i]
            moment = np.cross(first - mass[:, :, None] * pivots, weight)
            own = np.einsum("snji,snj->sni", before, moment)
            new = np.einsum("npi,np,npj,snj->sni", self.principal, self.compliance, self.principal, own)
            if np.abs(new - bend).max() < 1e-13:
                break
            bend = new
        return bend

    def tool(self, q: np.ndarray, side: str, *, true: bool) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (N, 3, 3) and position (N, 3) of the frame of a hand."""
        bend = self.bent(q) if true else np.zeros((*q.shape, 3))
        rotation, shift, _ = self.swept(q, bend, true=true)
        i = self.tips[side]
        return rotation[:, i], np.einsum("sij,j->si", rotation[:, i], self.hand[side]) + shift[:, i]

    def reflector(self, q: np.ndarray, side: str, *, true: bool = True) -> np.ndarray:
        """Position (N, 3), m, of a hand's reflector in the base frame."""
        rotation, position = self.tool(q, side, true=true)
        return position + rotation @ (self.true_xyz if true else self.declared_xyz)[side]

    def postures(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Joint positions (count, n)."""
        wide = np.array([0.8 if link.name.startswith("waist") else 1.2 for link in self.links])
        return rng.uniform(-wide, wide, (count, self.n))

    def measured(self, q: np.ndarray, side: str, rng: np.random.Generator) -> np.ndarray:
        """The reflector in the tracker's frame (N, 3), with the robot's jitter and the tracker's noise."""
        at = self.reflector(q + self.jitter * rng.normal(size=q.shape), side)
        seen = at @ self.tracker[0].T + self.tracker[1]
        return seen + self.tracker_noise * rng.normal(size=seen.shape)

    def seen_from_hand(self, q: np.ndarray, rng: np.random.Generator, noise: float = 5e-5) -> np.ndarray:
        """The right reflector (N, 3), m, as a probe mounted somehow on the left hand reads it."""
        real = q + self.jitter * rng.normal(size=q.shape)
        rotation, position = self.tool(real, "left", true=True)
        inside = np.einsum("sji,sj->si", rotation, self.reflector(real, "right") - position)
        seen = inside @ turn(np.array([0.3, -0.5, 0.2])).T + [0.03, 0.05, -0.02]
        return seen + noise * rng.normal(size=seen.shape)

    def write_on_cart(self, path: Path, count: int, rng: np.random.Generator, tilt: float = 0.0) -> Path:
        """The left reflector and markers on a cart that carries the robot, both in the room's axes."""
        q = self.postures(count, rng)
        place = np.column_stack([rng.uniform(-3, 3, (count, 2)), np.zeros(count)])
        heading = np.column_stack([tilt * rng.normal(size=(count, 2)), rng.uniform(-3, 3, count)])
        cart, mark = turn(heading), turn(np.array([0.2, 0.1, 1.0]))
        point = self.reflector(q + self.jitter * rng.normal(size=q.shape), "left")
        seen = np.einsum("sij,sj->si", cart, point) + place
        seen += self.tracker_noise * rng.normal(size=seen.shape)
        markers = np.einsum("sij,j->si", cart, [0.3, -0.2, 0.1]) + place
        columns = ["base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw"]
        lines = [",".join(["pose", *(f"q{i + 1}" for i in range(self.n)), "x", "y", "z", *columns])]
        for k in range(count):
            trace = cart[k] @ mark
            w = np.sqrt(max(1 + np.trace(trace), 1e-9)) / 2
            xyz = np.array(
                [trace[2, 1] - trace[1, 2], trace[0, 2] - trace[2, 0], trace[1, 0] - trace[0, 1]]
            ) / (4 * w)
            numbers = (*q[k], *seen[k], *markers[k], *xyz, w)
            lines.append(",".join([str(k + 1), *(repr(float(v)) for v in numbers)]))
        path.write_text("\n".join(lines) + "\n")
        return path

    def write_relative(self, path: Path, count: int, rng: np.random.Generator) -> Path:
        """Measurements of the right reflector by the probe on the left hand, a station `probe`."""
        q = self.postures(count, rng)
        lines = [
            ",".join(["pose", *(f"q{i + 1}" for i in range(self.n)), "x", "y", "z", "target", "station"])
        ]
        for k, (row, point) in enumerate(zip(q, self.seen_from_hand(q, rng), strict=True)):
            lines.append(",".join([str(k + 1), *(repr(float(v)) for v in (*row, *point)), "right", "probe"]))
        path.write_text("\n".join(lines) + "\n")
        return path

    def write(self, folder: Path, more: str = "") -> Path:
        """robot.urdf and robot.yaml."""
        folder.mkdir(parents=True, exist_ok=True)
        parts = ['<link name="base"/>']
        for i, link in enumerate(self.links):
            own, was = np.array(link.origin), np.zeros(3) if link.parent < 0 else self.origin[link.parent]
            centre = " ".join(map(repr, (self.centre[i] - own).tolist()))
            parts.append(
                f'<link name="l_{link.name}"><inertial><origin xyz="{centre}"/><mass value="{link.mass!r}"/>'
                '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            )
            parent = "base" if link.parent < 0 else f"l_{self.links[link.parent].name}"
            kind, xyz = "prismatic" if link.slides else "revolute", " ".join(map(repr, (own - was).tolist()))
            parts.append(
                f'<joint name="{link.name}" type="{kind}"><parent link="{parent}"/><child link="l_{link.name}"/>'
                f'<origin xyz="{xyz}"/><axis xyz="{" ".join(map(str, link.axis))}"/>'
                '<limit lower="-2.5" upper="2.5" effort="200" velocity="2"/></joint>'
            )
        for side, i in self.tips.items():
            xyz = " ".join(map(repr, (self.hand[side] - self.origin[i]).tolist()))
            parts.append(f'<link name="{side}_hand"/><joint name="{side}_mount" type="fixed">')
            parts.append(
                f'<parent link="l_{self.links[i].name}"/><child link="{side}_hand"/><origin xyz="{xyz}"/></joint>'
            )
        (folder / "torso.urdf").write_text(f'<robot name="stranger_torso">{"".join(parts)}</robot>')
        places = "".join(
            f"  {side}: {{frame: {side}_hand, xyz: {self.declared_xyz[side].tolist()}}}\n"
            for side in self.tips
        )
        robot = folder / "robot.yaml"
        robot.write_text(f"robot: torso.urdf\npoints:\n{places}{more}")
        return robot

    def write_poses(self, path: Path, count: int, rng: np.random.Generator, sides=("left", "right")) -> Path:
        """Measurements of `count` postures, of each side in other postures."""
        lines = [",".join(["pose", *(f"q{i + 1}" for i in range(self.n)), "x", "y", "z", "target"])]
        number = 0
        for side in sides:
            q = self.postures(count, rng)
            seen = self.measured(q, side, rng)
            for row, point in zip(q, seen, strict=True):
                number += 1
                lines.append(",".join([str(number), *(repr(float(v)) for v in (*row, *point)), side]))
        path.write_text("\n".join(lines) + "\n")
        return path
