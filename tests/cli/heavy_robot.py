"""A six-axis robot of the 20 kg class and a laser tracker, with nothing of flexcal in them: rotation matrices, springs, gravity."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

X, Y, Z = np.eye(3)
JOINTS = ("A1", "A2", "A3", "A4", "A5", "A6")
AXES = (Z, Y, Y, X, Y, X)
ORIGINS = np.array([[0, 0, 0.25], [0.16, 0, 0.27], [0, 0, 0.78], [0.3, 0, 0.15], [0.56, 0, 0], [0.15, 0, 0]])
LIMITS = np.array([[-2.9, 2.9], [-0.9, 1.9], [-2.0, 1.2], [-3.0, 3.0], [-2.0, 2.0], [-3.1, 3.1]])
MASSES = np.array([78.0, 42.0, 47.0, 19.0, 7.5, 1.5])
COMS = np.array(
    [[0.07, 0.02, 0.18], [0, 0.05, 0.36], [0.1, -0.03, 0.09], [0.28, 0, 0.01], [0.03, 0, 0.02], [0, 0, 0]]
)
DRIVES = np.array([620e3, 890e3, 470e3, 95e3, 70e3, 48e3])
BEARINGS = np.array([[1.3e6, 0.65e6], [1.6e6, 0.9e6], [0.8e6, 0.42e6]])
"""N m/rad about two axes normal to the first three joints', at right angles to each other."""
TILTS = ((X, Y), (X, -Z), (X, -Z))
"""Those axes, in the parent link."""
PAYLOAD, PAYLOAD_AT = 20.0, np.array([0.16, 0.02, -0.05])
REFLECTOR = np.array([0.12, 0.05, 0.11])
GRAVITY = np.array([0, 0, -9.81])
TRACKER, REPEATABILITY = 0.018e-3, 0.020e-3
"""m a coordinate, both on every point."""


def about(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) by angles (N,) rad about an axis."""
    across = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.asarray(angle)[:, None, None]
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


@dataclass(frozen=True)
class HeavyRobot:
    """One as built: where each joint sits (m, rad), its encoder's zero (rad), stiffness (N m/rad), masses (kg) and where they are (m).

    `turning`: the bearings' axes turn with the child link; otherwise they are fixed to the parent.
    """

    shift: np.ndarray
    lean: np.ndarray
    zero: np.ndarray
    drives: np.ndarray
    bearings: np.ndarray
    masses: np.ndarray
    coms: np.ndarray
    turning: bool

    @classmethod
    def drawn(cls, seed: int, *, spread: float = 0.07, turning: bool = False) -> HeavyRobot:
        """Joints 0.3 mm and 0.5 mrad off, stiffnesses off by `spread`, masses by 3 %, centres of mass by 5 mm."""
        rng = np.random.default_rng(seed)
        return cls(
            shift=3e-4 * rng.normal(size=(6, 3)),
            lean=5e-4 * rng.normal(size=(6, 3)),
            zero=5e-4 * rng.normal(size=6),
            drives=DRIVES * np.exp(spread * rng.normal(size=6)),
            bearings=BEARINGS * np.exp(spread * rng.normal(size=(3, 2))),
            masses=MASSES * (1 + 0.03 * rng.normal(size=6)),
            coms=COMS + 5e-3 * rng.normal(size=(6, 3)),
            turning=turning,
        )

    def reflector(self, q: np.ndarray) -> np.ndarray:
        """Where the reflector is (N, 3), m, with the motors at `q` (N, 6) and the arm at rest under gravity."""
        springs = np.zeros((len(q), 6, 3))
        for _ in range(50):
            before = springs
            position, springs = self._pass(q, springs)
            if np.abs(springs - before).max() < 1e-15:
                return position
        raise AssertionError("the springs do not settle")

    def _pass(self, q: np.ndarray, springs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reflector, and what the load of the arm makes of the springs (N, 6, 3): twist, first tilt, second tilt."""
        count = len(q)
        turn, at = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
        axes, origins, bodies = np.zeros((count, 6, 3, 3)), np.zeros((count, 6, 3)), np.zeros((count, 6, 3))
        for i in range(6):
            at = at + turn @ (ORIGINS[i] + self.shift[i])
            size = np.linalg.norm(self.lean[i])
            turn = turn @ about(self.lean[i] / size, np.array([size]))[0]
            angle = q[:, i] + self.zero[i] + springs[:, i, 0]
            origins[:, i] = at
            if self.turning:
                axes[:, i, 0] = turn @ AXES[i]
                turn = turn @ about(AXES[i], angle)
            for k in range(2 if i < 3 else 0):
                axes[:, i, 1 + k] = turn @ TILTS[i][k]
                turn = turn @ about(TILTS[i][k], springs[:, i, 1 + k])
            if not self.turning:
                axes[:, i, 0] = turn @ AXES[i]
                turn = turn @ about(AXES[i], angle)
            bodies[:, i] = at + turn @ self.coms[i]
        held = at + turn @ PAYLOAD_AT
        load = np.zeros((count, 6, 3))
        for i in range(6):
            moment = PAYLOAD * np.cross(held - origins[:, i], GRAVITY)
            for j in range(i, 6):
                moment += self.masses[j] * np.cross(bodies[:, j] - origins[:, i], GRAVITY)
            load[:, i] = np.einsum("nkx,nx->nk", axes[:, i], moment)
        stiffness = np.full((6, 3), np.inf)
        stiffness[:, 0], stiffness[:3, 1:] = self.drives, self.bearings
        return at + turn @ REFLECTOR, load / stiffness

    def measured(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What a tracker somewhere in the hall reads (N, 3), m."""
        noise = np.hypot(TRACKER, REPEATABILITY) * rng.normal(size=(len(q), 3))
        stand = about(Z, np.array([2.2]))[0] @ about(X, np.array([0.04]))[0]
        return (self.reflector(q) + noise) @ stand.T + [3.1, -0.6, 0.4]


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Joint positions (N, 6) at which the reflector is above the floor and before the base."""
    ideal = HeavyRobot.drawn(0)
    q = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (40 * count, 6))
    at = ideal.reflector(q)
    return q[(at[:, 2] > 0.2) & (np.hypot(at[:, 0], at[:, 1]) > 0.5)][:count]


def write_robot(folder: Path, bearings: str | None) -> Path:
    """robot.yaml and URDF as a user would write them from the data sheet; `bearings` None: not said."""
    parts, below = ['<link name="base"/>'], "base"
    for i, name in enumerate(JOINTS):
        link, mass = f"link_{i + 1}", MASSES[i]
        inertia = " ".join(
            f'i{k}="{0.02 * mass if k in ("xx", "yy", "zz") else 0}"'
            for k in ("xx", "xy", "xz", "yy", "yz", "zz")
        )
        parts.append(
            f'<link name="{link}"><inertial><origin xyz="{_text(COMS[i])}"/><mass value="{mass}"/><inertia {inertia}/></inertial></link>'
            f'<joint name="{name}" type="revolute"><parent link="{below}"/><child link="{link}"/><origin xyz="{_text(ORIGINS[i])}"/>'
            f'<axis xyz="{_text(AXES[i])}"/><limit lower="{LIMITS[i, 0]}" upper="{LIMITS[i, 1]}" effort="2000" velocity="3"/></joint>'
        )
        below = link
    (folder / "heavy.urdf").write_text(f'<robot name="heavy">{"".join(parts)}</robot>')
    lines = [
        "robot: heavy.urdf",
        f"points: {{ball: {{frame: link_6, xyz: {REFLECTOR.tolist()}}}}}",
        f"payload: {{frame: link_6, mass: {PAYLOAD}, com: {PAYLOAD_AT.tolist()}, mass_std: 0.02}}",
        "prior: {mass: 0.03, com: 0.005, rotor_inertia: 0.05}",
        *([] if bearings is None else [f"bearings: {bearings}"]),
        "elastic:",
    ]
    for i, name in enumerate(JOINTS):
        lines += [f"  - joint: {name}", f"    drive: {{stiffness: {DRIVES[i]}, damping: 50}}"]
        if i < 3:
            lines += [
                f"    bearing_{k}: {{stiffness: {c}, damping: 50}}"
                for k, c in zip("xy", BEARINGS[i], strict=True)
            ]
            lines += [f"    frame_rpy: [{0 if i == 0 else -np.pi / 2}, 0, 0]"]
    path = folder / "robot.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def write_poses(path: Path, q: np.ndarray, xyz: np.ndarray, sigma: float | None) -> None:
    """A table of poses; `sigma` (m) is what the user states of the instrument."""
    names = ["pose", *(f"q{i + 1}" for i in range(6)), "x", "y", "z", *([] if sigma is None else ["sigma"])]
    rows = [",".join(names)]
    for k, (joints, point) in enumerate(zip(q, xyz, strict=True)):
        values = [repr(float(v)) for v in (*joints, *point)] + ([] if sigma is None else [repr(sigma)])
        rows.append(",".join([str(k), *values]))
    path.write_text("\n".join(rows) + "\n")


def _text(values: np.ndarray) -> str:
    return " ".join(f"{v:.6g}" for v in values)
