"""A DH arm before a tracker that stands still, calibrated once and visited again and again; made by NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from dh_arm import DHArm, postures, rx, ry, rz, write_poses, write_robot

from flexcal import CalibratedRobot, RobotModel, calibrate, read_poses
from flexcal.calibration.recheck import JudgedVisit, errors_from_reference, judge_visit
from flexcal.data.poses import PoseSet


@dataclass
class Workshop:
    """`arm` with a repeatability of `angular` rad a joint, before a tracker with 15 µm + 6 µm/m at `place`; heavy tails of Student's t with
    `tail` degrees of freedom where that is given.
    """

    folder: Path
    arm: DHArm
    rng: np.random.Generator
    angular: float = 1.5e-5
    tail: float | None = None
    place: np.ndarray = field(default_factory=lambda: np.eye(4))

    @classmethod
    def made(cls, folder: Path, seed: int, tail: float | None = None) -> Workshop:
        rng = np.random.default_rng([seed, 21])
        shop = cls(folder, DHArm.made(seed), rng, tail=tail)
        shop.place = shop.new_place()
        return shop

    def new_place(self) -> np.ndarray:
        place = rz(self.rng.uniform(-3, 3)) @ ry(0.2 * self.rng.normal()) @ rx(0.2 * self.rng.normal())
        place[:3, 3] = 0.3 * self.rng.normal(size=3) + [2.5, 0.0, 0.0]
        return place

    def normal(self, shape: tuple[int, ...]) -> np.ndarray:
        if self.tail is None:
            return self.rng.normal(size=shape)
        return self.rng.standard_t(self.tail, size=shape) * np.sqrt((self.tail - 2) / self.tail)

    def written(
        self, name: str, q: np.ndarray, arm: DHArm | None = None, place: np.ndarray | None = None, growth=0.0
    ) -> Path:
        """A file of measured poses."""
        at = self.place if place is None else place
        points = (arm or self.arm).points(q + self.angular * self.normal(q.shape)) * (1 + growth)
        seen = points @ at[:3, :3].T + at[:3, 3]
        sigma = 15e-6 + 6e-6 * np.linalg.norm(seen, axis=1)
        seen = seen + sigma[:, None] * self.normal(seen.shape)
        return write_poses(self.folder / name, q, seen, float(sigma.mean()))

    def measured(self, model: RobotModel, q: np.ndarray, **change) -> PoseSet:
        return read_poses(self.written("measured.csv", q, **change), model)

    def calibrated(self, count: int = 60) -> CalibratedRobot:
        model = RobotModel.from_yaml(write_robot(self.folder), estimates=False)
        return calibrate(model, self.measured(model, postures(self.rng, count))).robot

    def longer(self, link: int, length: float) -> DHArm:
        """The arm with a longer and tilted link, which no single change is."""
        rows = self.arm.rows.copy()
        rows[link, 2] += length
        rows[link, 3] += 2 * length
        return replace(self.arm, rows=rows)


def judged_beside(
    model: RobotModel, visit: PoseSet, reference: PoseSet, *, placed: bool = False
) -> JudgedVisit:
    """The judgement alone of a visit beside a reference."""
    found = judge_visit(
        lambda place: errors_from_reference(model, visit, reference, placed=place), placed=placed
    )
    assert found is not None
    return found
