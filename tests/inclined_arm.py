"""An arm with an inclinometer that shares nothing with ours: products of rotations in plain NumPy."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flexcal import RobotModel

AXES = np.array([(0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)], dtype=float)
ORIGINS = [(0, 0, 0.3), (0, 0, 0.1), (0, 0, 0.5), (0.1, 0, 0.1), (0.4, 0, 0), (0.1, 0, 0)]
NOISE = 5e-5
ZEROS = np.array([0.003, -0.002])


def write_urdf(folder: Path) -> None:
    parts, before = ['<robot name="strange"><link name="base"/>'], "base"
    for k, (axis, origin) in enumerate(zip(AXES, ORIGINS, strict=True), 1):
        parts.append(
            f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="{before}"/><child link="l{k}"/>'
            f'<origin xyz="{" ".join(map(str, origin))}"/><axis xyz="{" ".join(map(str, axis))}"/>'
            '<limit lower="-2.8" upper="2.8" velocity="2" effort="100"/></joint>'
        )
        before = f"l{k}"
    (folder / "r.urdf").write_text("".join([*parts, "</robot>"]))


def robot(folder: Path, declared: str = "std: 5e-5") -> RobotModel:
    write_urdf(folder)
    (folder / "robot.yaml").write_text(
        f"robot: r.urdf\nmeasurements: {{level: {{kind: inclinometer, frame: l6, {declared}}}}}\n"
    )
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def elevation(up: np.ndarray) -> np.ndarray:
    return np.arcsin(up[:2])


def projection(up: np.ndarray) -> np.ndarray:
    return np.arctan2(up[:2], up[2])


def measured(
    seed: int,
    reads: Callable[[np.ndarray], np.ndarray] = elevation,
    noise: float = NOISE,
    *,
    turned: float = 1.0,
    at: np.ndarray | None = None,
) -> np.ndarray:
    """Rows q1…q6, tilt_x, tilt_y of an arm with errors of some mrad at every joint, on a base that is inclined by 22 mrad.

    The sensor is `turned` about a random axis, rad; with `at` (N, 6) the poses are these, else random ones.
    """
    rng = np.random.default_rng(seed)
    errors = 3e-3 * rng.normal(size=(6, 3))
    mounted = Rotation.from_rotvec(turned * rng.normal(size=3))
    vertical = Rotation.from_rotvec([0.01, -0.02, 0]).apply([0, 0, 1])
    if at is not None:
        return np.array(
            [
                [*q, *(reads(up(q, errors, mounted, vertical)) + ZEROS + noise * rng.normal(size=2))]
                for q in at
            ]
        )
    rows = []
    while len(rows) < 70:
        q = rng.uniform(-2, 2, 6)
        inside = up(q, errors, mounted, vertical)
        if np.abs(inside[:2]).max() < 0.95:
            rows.append([*q, *(reads(inside) + ZEROS + noise * rng.normal(size=2))])
    return np.array(rows)


def up(q: np.ndarray, errors: np.ndarray, mounted: Rotation, vertical: np.ndarray) -> np.ndarray:
    """The vertical in the axes of the sensor."""
    turn = Rotation.identity()
    for error, axis, angle in zip(errors, AXES, q, strict=True):
        turn = turn * Rotation.from_rotvec(error) * Rotation.from_rotvec(angle * axis)
    return (turn * mounted).inv().apply(vertical)


def written(folder: Path, rows: np.ndarray) -> Path:
    path = folder / "tilts.csv"
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    path.write_text("\n".join(["q1,q2,q3,q4,q5,q6,tilt_x,tilt_y", *lines]) + "\n")
    return path
