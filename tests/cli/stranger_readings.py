"""Files of readings of every kind that a stranger's arm would give: points, full poses, wires, dial gauge, contacts, and a ball in sockets.

All of it is computed with the arm's own kinematics, batch by batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from stranger_arm import SIX, StrangerArm, turn

from flexcal import PoseSet, RobotModel, read_poses

ANCHORS = {"east": (1.6, 0.9, 0.1), "west": (1.2, -1.4, 0.3), "top": (-0.3, 0.3, 2.6)}
ZEROS = {"east": 0.02, "west": -0.03, "top": 0.05}
NORMALS = np.array([(0.05, -0.02, 1.0), (1.0, 0.1, 0.2), (0.1, 1.0, -0.1)])
PLACES = np.array([(0.05, 0.1, -0.25), (0.25, 0.0, 0.1), (0.0, -0.2, 0.1)])
RADII = (0.12, 0.15, 0.18)
APART = 0.08
TURNED = 4.0
"""Noise of an orientation, rad, over that of a point, m."""


@dataclass(frozen=True)
class Asked:
    """`count` readings of a kind with noise `sigma`, m, that robot.yaml or file state as `stated`; None: not at all."""

    kind: str
    count: int
    sigma: float
    stated: float | None


def right(kind: str, count: int, sigma: float = 5e-5) -> Asked:
    """Readings whose stated noise is right; that of a ball in sockets is never stated."""
    return Asked(kind, count, sigma, None if kind == "sockets" else sigma)


class ReadArm(StrangerArm):
    """An arm of strangers that is read by anything, its reflector anywhere within some millimetres."""

    @classmethod
    def drawn(cls, seed: int) -> ReadArm:
        arm = cls(seed, axes=tuple(SIX))
        arm.true_xyz = np.array(arm.declared_xyz) + 0.004 * np.random.default_rng([seed, 9]).normal(size=3)
        return arm

    def tools(self, q: np.ndarray) -> np.ndarray:
        """True flange in the base frame (N, 4, 4)."""
        at = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for k, (axis, origin) in enumerate(zip(self.true_direction, self.true_origin, strict=True)):
            step = np.zeros((len(q), 4, 4))
            angle = q[:, k] + self.zeros[k]
            step[:, :3, :3] = Rotation.from_rotvec(angle[:, None] * axis / np.linalg.norm(axis)).as_matrix()
            step[:, :3, 3] = origin - step[:, :3, :3] @ origin
            step[:, 3, 3] = 1.0
            at = at @ step
        return at @ self.true_flange

    def points(self, q: np.ndarray) -> np.ndarray:
        """True positions (N, 3) of the reflector in the base frame."""
        return (self.tools(q) @ np.append(self.true_xyz, 1.0))[:, :3]

    def touching(
        self, rng: np.random.Generator, count: int, off: Callable[[np.ndarray, np.ndarray], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Joint positions (count, 6) where `off` (N, k) of points and standard normal numbers (N, 3) vanishes, and those numbers."""
        found, drawn = [], []
        while sum(map(len, found)) < count:
            q, error = self.postures(2 * count, rng), rng.normal(size=(2 * count, 3))
            there = np.zeros(len(q), bool)
            for _ in range(25):
                now = off(self.points(q), error)
                there = np.linalg.norm(now, axis=1) < 1e-10
                slopes = [(off(self.points(q + 1e-6 * e), error) - now) / 1e-6 for e in np.eye(self.n)]
                step = np.einsum("nij,nj->ni", np.linalg.pinv(np.stack(slopes, axis=2)), now)
                q = np.where(there[:, None], q, q - np.clip(step, -0.4, 0.4))
            there &= np.abs(q).max(axis=1) < 3
            found.append(q[there])
            drawn.append(error[there])
        return np.concatenate(found)[:count], np.concatenate(drawn)[:count]


def readings(folder: Path, arm: ReadArm, asked: Sequence[Asked], seed: int) -> tuple[RobotModel, PoseSet]:
    """Robot of a robot.yaml, and what it reads of one file a kind, all written into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    files, declared = [], []
    for number, one in enumerate(asked):
        header, rows, entries = _KINDS[one.kind](arm, one, np.random.default_rng([seed, number, 77]))
        cells = [[v if isinstance(v, str) else repr(float(v)) for v in row] for row in rows]
        files.append(folder / f"{number}_{one.kind}.csv")
        files[-1].write_text("\n".join(map(",".join, [header, *cells])) + "\n")
        declared += entries
    more = f"measurements: {{{', '.join(declared)}}}\n" if declared else ""
    model = RobotModel.from_yaml(arm.write(folder, more))
    return model, read_poses(files, model)


Table = tuple[list[str], list[list], list[str]]
_Q = [f"q{k + 1}" for k in range(6)]


def _std(one: Asked) -> str:
    return "" if one.stated is None else f", std: {one.stated}"


def _points(arm: ReadArm, one: Asked, rng: np.random.Generator) -> Table:
    q = arm.postures(one.count, rng)
    seen = (
        arm.points(q) @ arm.tracker[:3, :3].T
        + arm.tracker[:3, 3]
        + one.sigma * rng.normal(size=(one.count, 3))
    )
    header, columns = ["pose", *_Q, "x", "y", "z"], [np.arange(1, one.count + 1)[:, None], q, seen]
    if one.kind == "poses":
        axes = arm.tracker[:3, :3] @ arm.tools(q)[:, :3, :3] @ turn(np.array([0.3, -0.5, 1.1]))
        error = Rotation.from_rotvec(TURNED * one.sigma * rng.normal(size=(one.count, 3)))
        columns.append((error * Rotation.from_matrix(axes)).as_quat(scalar_first=True))
        header += ["qw", "qx", "qy", "qz"]
    if one.stated is not None:
        sizes = [one.stated, *([TURNED * one.stated] if one.kind == "poses" else [])]
        columns.append(np.tile(sizes, (one.count, 1)))
        header += ["sigma", "sigma_angle"][: len(sizes)]
    rows = np.column_stack(columns).tolist()
    return header, [[str(int(row[0])), *row[1:]] for row in rows], []


def _wires(arm: ReadArm, one: Asked, rng: np.random.Generator) -> Table:
    known = tuple(ANCHORS) if one.kind == "wires" else ("east",)
    q, names = arm.postures(one.count, rng), rng.choice(known, one.count).tolist()
    lengths = np.linalg.norm(arm.points(q) - [ANCHORS[name] for name in names], axis=1)
    lengths += one.sigma * rng.normal(size=one.count) - [ZEROS[name] for name in names]
    rows = [[*a, name, length] for a, name, length in zip(q, names, lengths, strict=True)]
    return (
        [*_Q, "wire", "length"],
        rows,
        [f"{name}: {{kind: wire{_std(one)}, scale_std: 1.0e-6}}" for name in known],
    )


def _sockets(arm: ReadArm, one: Asked, rng: np.random.Generator) -> Table:
    middle, rows, places = arm.points(arm.postures(50, np.random.default_rng(5))).mean(axis=0), [], 6
    for k in range(places):
        at, stands = middle + 0.15 * rng.normal(size=3), turn(rng.normal(size=3))
        for name, place in (("a", at), ("b", at + APART * stands[:, 1])):
            q, _ = arm.touching(
                rng, one.count // (2 * places), lambda p, error, place=place: p - place - one.sigma * error
            )
            rows += [[f"place{k}", name, *row] for row in q]
    sockets = f"{{a: [0, 0, 0], b: [0, {APART}, 0]}}"
    return (
        ["fixture", "socket", *_Q],
        rows,
        [f"fixture: {{kind: sockets, sockets: {sockets}, std: 1.0e-6}}"],
    )


def _contacts(arm: ReadArm, one: Asked, rng: np.random.Generator) -> Table:
    middle, rows = arm.points(arm.postures(50, np.random.default_rng(5))).mean(axis=0), []
    for i, (normal, place) in enumerate(zip(NORMALS, PLACES, strict=True)):
        axis, centre = normal / np.linalg.norm(normal), middle + place
        across = np.linalg.svd(axis[None])[2][1:]

        def off(p: np.ndarray, error: np.ndarray, axis=axis, centre=centre, across=across, i=i) -> np.ndarray:
            away = p - centre
            if one.kind == "line":
                return away @ across.T - one.sigma * error[:, :2]
            if one.kind == "sphere":
                return (np.linalg.norm(away, axis=1) - RADII[i] - one.sigma * error[:, 0])[:, None]
            read = _gap(error) if one.kind == "dial" else one.sigma * error[:, 0]
            return (away @ axis - read)[:, None]

        q, error = arm.touching(rng, one.count // 3, off)
        read = _gap(error) + one.sigma * error[:, 0] if one.kind == "dial" else np.zeros(len(q))
        rows += [[*row, f"{one.kind}{i}", value] for row, value in zip(q, read, strict=True)]
    face = "plane" if one.kind == "dial" else one.kind
    return (
        [*_Q, "touched", "reading"],
        rows,
        [f"{one.kind}{i}: {{kind: {face}{_std(one)}}}" for i in range(3)],
    )


def _gap(error: np.ndarray) -> np.ndarray:
    """How far, m, the ball of a dial gauge is from the plane that it reads."""
    return 0.01 * np.abs(error[:, 1])


_KINDS: dict[str, Callable[[ReadArm, Asked, np.random.Generator], Table]] = {
    "points": _points,
    "poses": _points,
    "wire": _wires,
    "wires": _wires,
    "sockets": _sockets,
    "dial": _contacts,
    "plane": _contacts,
    "line": _contacts,
    "sphere": _contacts,
}
