"""The virtual cell: a robot with a hidden truth that can be excited and measured like a real one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flexcal.data.plans import MultisinePlan, PosePlan, TrajectoryPlan
from flexcal.data.poses import PoseSet
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.frequency_experiment import recordings
from flexcal.virtual_cell.pose_measurement import in_instrument, measured_poses, true_poses
from flexcal.virtual_cell.trajectory_experiment import trajectory_recordings
from flexcal.virtual_cell.true_parameters import draw_truth, read_truth_of

_TRACKER = 2**32  # keeps the tracker's random numbers apart from those of the recordings


class VirtualCell:
    """Simulated robot cell: a MuJoCo robot with known true parameters, its controller and its instruments.

    Parameters
    ----------
    truth : RobotModel
        Robot with the true values.
    config : CellConfig, optional
        Sensors, friction, controller and mismatch.
    seed : int
        Seed of the noise. Every output is a function of it, the plan and its seed, whatever the number of `threads`.
    controller_model : RobotModel, optional
        Robot of the controller's feed-forward; by default the true one, so that the arm does not droop.
    threads : int, optional
        Number of threads; by default one per core.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import PosePlan, RobotModel, VirtualCell
    >>> cell = VirtualCell(RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False))
    >>> cell.measure(PosePlan(q=np.array([[0, -0.5, 1.6, 0, 0.6, 0]]))).position.shape
    (1, 3)
    """

    def __init__(
        self,
        truth: RobotModel,
        config: CellConfig | None = None,
        seed: int = 0,
        *,
        controller_model: RobotModel | None = None,
        threads: int | None = None,
    ) -> None:
        self.truth = truth
        self.config = CellConfig() if config is None else config
        self.seed = seed
        self.controller_model = truth if controller_model is None else controller_model
        self.threads = threads or os.cpu_count() or 1

    @classmethod
    def drawn(
        cls, nominal: RobotModel, config: CellConfig, seed: int, truth: Path | None = None
    ) -> tuple[VirtualCell, dict[str, float]]:
        """Virtual cell whose robot differs from a nominal one, with which the controller computes.

        Parameters
        ----------
        nominal : RobotModel
            Nominal robot.
        config : CellConfig
            Settings of the cell, with the standard deviations of the true parameters.
        seed : int
            Seed of the true parameters and of the noise.
        truth : Path, optional
            File of true parameters, in place of random ones.

        Returns
        -------
        cell : VirtualCell
            The cell.
        values : dict of float
            True values by name, SI units.

        Raises
        ------
        InputError
            As `read_truth_of` does.
        """
        rng = np.random.default_rng([seed, 0])
        values = draw_truth(nominal, config.spread, rng) if truth is None else read_truth_of(truth, nominal)
        return cls(nominal.with_values(values), config, seed, controller_model=nominal), values

    def record(self, plan: MultisinePlan | TrajectoryPlan) -> Iterator[Recording]:
        """Run the experiments of a plan.

        Parameters
        ----------
        plan : MultisinePlan or TrajectoryPlan
            Frequency experiments or trajectories.

        Returns
        -------
        iterator of Recording
            By pose, realisation, orthogonal experiment and sign (+1, then −1); or by trajectory. `q` (N, n) are encoder readings and
            `torque` (N, n) the torque held until the next sample, with sensor noise; in a frequency experiment, joints that are not
            excited are braked at the pose and read a torque of zero.

        Raises
        ------
        FlexcalError
            For a joint count that does not fit, an excited drive without rotor inertia, a time step that does not resolve the robot, or
            a loop that diverges.
        """
        self._check_width(plan.joint_count)
        self._check_rotors(plan)
        if isinstance(plan, TrajectoryPlan):
            return trajectory_recordings(self.truth, self.controller_model, self.config, plan, self.seed)
        return recordings(self.truth, self.controller_model, self.config, plan, self.seed, self.threads)

    def measure(self, plan: PosePlan) -> PoseSet:
        """Measure the first declared point in every pose with the tracker at the first station.

        Parameters
        ----------
        plan : PosePlan
            The poses.

        Returns
        -------
        PoseSet
            `q` are encoder readings, `torque` is that of gravity plus Coulomb friction of random sign and size within its band plus
            noise, `sigma` the tracker's standard deviation per axis.
        """
        self._check_width(plan.joint_count)
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(plan.seed, _TRACKER)))
        return measured_poses(self.truth, self.config, plan, rng)

    def noise_free(self, plan: PosePlan) -> np.ndarray:
        """True positions of the first declared point, for verification only.

        Parameters
        ----------
        plan : PosePlan
            The poses.

        Returns
        -------
        ndarray
            Positions (N, 3), m, in the instrument's frame.
        """
        self._check_width(plan.joint_count)
        return in_instrument(self.truth, true_poses(self.truth, self.config, plan).point)

    def _check_rotors(self, plan: MultisinePlan | TrajectoryPlan) -> None:
        moving = range(self.truth.n) if isinstance(plan, TrajectoryPlan) else plan.joints
        for spring in self.truth.elastic:
            if spring.index in moving and not self.truth.drives.rotor_inertia[spring.index] > 0:
                raise FlexcalError(
                    "E-CELL-012",
                    f"{self.truth.path} gives {spring.name} no positive rotor inertia, and a motor before a drive spring cannot move "
                    "without one; add `drives: {rotor_inertia: […]}` in kg m² at the joint.",
                )

    def _check_width(self, joints: int) -> None:
        if joints != self.truth.n:
            raise FlexcalError(
                "E-CELL-013",
                f"the plan's poses have {joints} joints but {self.truth.name} has {self.truth.n}.",
            )
