"""The corrected command of one target that was typed in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.accuracy import predicted_accuracy
from flexcal.calibration.measurement import propagation
from flexcal.data.poses import ToolTargets
from flexcal.jobs.deployment import compensate
from flexcal.jobs.inputs import CalibratedRobot, is_station_identified, unmeasured_targets_remark
from flexcal.model.parts import rotation_rpy, rpy_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest


@dataclass(frozen=True, eq=False)
class TypedTarget:
    """A target of the tool.

    Parameters
    ----------
    point : str
        Point of robot.yaml that is to be there.
    position : ndarray
        Position (3,), m.
    rpy : ndarray or None
        Roll, pitch, yaw (3,), rad: R_z(yaw) R_y(pitch) R_x(roll), as in a URDF; None where the orientation does not matter.
    station : str
        Instrument in whose frame both are; empty for the robot's base frame.
    """

    point: str
    position: np.ndarray
    rpy: np.ndarray | None = None
    station: str = ""

    @classmethod
    def of_tool(cls, model: RobotModel, q: np.ndarray, point: str) -> TypedTarget:
        """Where the tool of a robot, which is taken as rigid, is at joint positions (n,)."""
        at = tool_at_rest(model, q[None], None, np.array([point]), elastic=False).kinematics
        return cls(point, at.position[0], rotation_rpy(at.orientation[0]))

    @property
    def targets(self) -> ToolTargets:
        """The same as the library's, with the number 1."""
        return ToolTargets(
            pose=np.array([1]),
            target=np.array([self.point]),
            position=self.position[None],
            rotation=None if self.rpy is None else rpy_rotation(self.rpy)[None],
            station=np.array([self.station]) if self.station else None,
        )


@dataclass(frozen=True, eq=False)
class CorrectedCommand:
    """The command that brings the tool of the calibrated robot to a target.

    Attributes
    ----------
    q : ndarray
        Command (n,), rad or m.
    nominal : ndarray
        What the nominal robot would be commanded (n,).
    before : float
        Distance, m, of the real tool from the target with the nominal command.
    position : ndarray
        Where the calibrated robot has the point (3,), m, base frame.
    mean, p95 : float or None
        Predicted mean error there and its 95 % bound, m; None for a point that was not measured.
    beyond : bool
        Whether the predicted error is above three times that near the calibrated poses.
    remarks : tuple of str
        What makes it doubtful.
    """

    q: np.ndarray
    nominal: np.ndarray
    before: float
    position: np.ndarray
    mean: float | None
    p95: float | None
    beyond: bool
    remarks: tuple[str, ...]

    @classmethod
    def of(
        cls, robot: CalibratedRobot, target: TypedTarget, start: np.ndarray | None = None
    ) -> CorrectedCommand:
        """Correct the command of a target; inverse kinematics starts at `start` (n,), by default far from singular.

        Raises `FlexcalError` as `compensate` does.
        """
        found = compensate(robot, target.targets, start=() if start is None else start.tolist())
        commands = found.commands
        at = tool_at_rest(found.model, commands.q, None, found.targets.target).kinematics
        mean = p95 = None
        if target.point in robot.measured:
            stations = [
                name for name in robot.nominal.stations.names if is_station_identified(robot.model, name)
            ]
            reach = propagation(robot.model, target=target.point, station=stations[0] if stations else None)
            predicted = predicted_accuracy(reach, commands.q, threads=1)
            mean, p95 = float(predicted.mean[0]), float(predicted.p95[0])
        remarks = dict.fromkeys([*found.remarks, *unmeasured_targets_remark(robot, [target.point])])
        if not commands.unambiguous[0]:
            remarks["the flank of a backlash is uncertain there"] = None
        if commands.elsewhere[0]:
            remarks["it was reached from another start only; the arm may be in another configuration"] = None
        return cls(
            commands.q[0],
            commands.nominal[0],
            float(commands.before[0]),
            at.position[0],
            mean,
            p95,
            bool(found.extrapolated[0]),
            tuple(remarks),
        )
