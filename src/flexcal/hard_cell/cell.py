"""The hard cell: the interface of the virtual cell, with an independently implemented robot."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flexcal.data.plans import MultisinePlan, PosePlan, TrajectoryPlan
from flexcal.data.poses import PoseSet
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.hard_cell.description import ArmDescription, read_description
from flexcal.hard_cell.pose_measurement import measured_points, true_points
from flexcal.hard_cell.recordings import multisine_recordings, trajectory_recordings
from flexcal.hard_cell.true_parameters import HardRobot, draw_robot


class HardCell:
    """A robot drawn around its description; every output is a function of `seed` and the plan, whatever the number of `threads`."""

    def __init__(
        self, robot: HardRobot, described: ArmDescription, seed: int = 0, *, threads: int | None = None
    ) -> None:
        self.robot, self.described, self.seed = robot, described, seed
        self.threads = threads or os.cpu_count() or 1

    @classmethod
    def drawn(cls, robot_file: Path, seed: int = 0) -> HardCell:
        """The cell of a robot.yaml, its true robot drawn from `seed`; raises `FlexcalError` for a robot that it cannot be."""
        described = read_description(robot_file)
        return cls(draw_robot(described, np.random.default_rng([seed, 0])), described, seed)

    def record(self, plan: MultisinePlan | TrajectoryPlan) -> Iterator[Recording]:
        """Recordings of the plan in its order: motor angles as counted (N, n) and the torques (N, n) that the controller believes in.

        Raises `FlexcalError` for a joint count that does not fit, motors without rotor inertia, and a loop that diverges.
        """
        self._check(plan.joint_count)
        if plan.torque == "instantaneous":
            raise FlexcalError(
                "E-CELL-001",
                "the hard cell's torque is held over a sample, not instantaneous; write `tau: held` in the plan.",
            )
        if not (self.robot.arm.rotor_inertia > 0).all():
            raise FlexcalError(
                "E-CELL-002",
                "the hard cell's motors need rotor inertias; add `drives: {rotor_inertia: […]}` to robot.yaml, in kg m² at the joint.",
            )
        if isinstance(plan, TrajectoryPlan):
            return trajectory_recordings(self.robot, self.described, plan, self.seed)
        return multisine_recordings(self.robot, self.described, plan, self.seed, self.threads)

    def measure(self, plan: PosePlan) -> PoseSet:
        """The first declared point at every pose as the tracker sees it, while the arm warms up; `sigma` is what the tracker states."""
        self._check(plan.joint_count)
        return measured_points(self.robot, self.described, plan, self.seed)

    def noise_free(self, plan: PosePlan) -> np.ndarray:
        """True positions (N, 3) m of the point in the instrument's frame, without noise, scatter and hysteresis; for verification only."""
        self._check(plan.joint_count)
        return true_points(self.robot, self.described, plan)

    def _check(self, joints: int) -> None:
        if joints != self.robot.n:
            raise FlexcalError(
                "E-CELL-003",
                f"the plan's poses have {joints} joints but {self.described.name} has {self.robot.n}.",
            )
