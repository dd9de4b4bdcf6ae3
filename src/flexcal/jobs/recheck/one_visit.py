"""Recheck of a robot by the poses of one visit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.recheck import (
    JudgedVisit,
    detection_limits,
    errors_from_calibration,
    errors_from_reference,
    judge_visit,
    moved_tool,
    telling_pose,
)
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.jobs.calibration import (
    fitted_points,
    outside_ranges,
    plausible_temperatures,
    with_plausible_temperatures,
)
from flexcal.jobs.inputs import (
    CalibratedRobot,
    is_station_identified,
    reference_temperature,
    with_temperature,
)
from flexcal.jobs.recheck.data_errors import disagreeing_poses, misread_visit
from flexcal.jobs.recheck.document import SHIFT
from flexcal.jobs.recheck.result import Recheck
from flexcal.model.kinematics import depends_on_temperature


def recheck(
    robot: CalibratedRobot,
    poses: PoseSet,
    *,
    reference: PoseSet | None = None,
    refit: bool = False,
    temperature: float | None = None,
) -> Recheck:
    """Judge by few measured poses whether a robot is as calibrated, and what changed.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    poses : PoseSet
        Joint positions (N, n) in rad or m and measured points (N, 3) in m, about ten.
    reference : PoseSet, optional
        The same poses, or some of them, as measured when the robot was as calibrated; errors of the model cancel then.
    refit : bool
        Whether the instrument stands elsewhere than at the calibration, or at the reference visit.
    temperature : float, optional
        Temperature of the arm, °C, for points that have none; by default that at which the calibrated parameters hold. The reference
        visit has its own.

    Returns
    -------
    Recheck
        Its `verdict`, `headline`, `summary()`, `document()`, `report(path)` and `write(folder)`.

    Raises
    ------
    FlexcalError
        For fewer than four poses, points that the calibration did not measure, measurements that are not of points, and where neither
        the noise of the instrument nor the scatter of the robot is known.

    Examples
    --------
    >>> from flexcal import RobotModel, calibrate, read_poses, recheck
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model)
    >>> robot = calibrate(model, poses.subset(slice(None, None, 13)), terms=["kinematic"]).robot
    >>> recheck(robot, poses.subset(slice(3, 1000, 100))).verdict
    'as_calibrated'
    """
    model = robot.model
    poses = without_implausible_temperatures(robot, poses)
    _require(robot, poses)
    poses, warm = with_temperature(robot, poses, temperature)
    if reference is not None:
        reference = without_implausible_temperatures(robot, reference)
        _require(robot, reference)
        warm = (*warm, *_reference_temperature(robot, poses, reference))
    unknown = any(not is_station_identified(model, station) for station in poses.stations)

    def against_calibration(rows: PoseSet) -> JudgedVisit | None:
        return judge_visit(
            lambda placed: errors_from_calibration(model, rows, placed=placed), placed=refit or unknown
        )

    def against_reference(rows: PoseSet) -> JudgedVisit | None:
        then = reference
        assert then is not None
        return judge_visit(
            lambda placed: errors_from_reference(model, rows, then, placed=placed),
            placed=refit or set(poses.stations) != set(then.stations),
        )

    absolute = against_calibration(poses)
    assert absolute is not None
    relative = None if reference is None else against_reference(poses)
    judged = relative or absolute
    compared = against_calibration if relative is None else against_reference
    whole = absolute.test.errors.covariance
    expected = float(np.sqrt(3 * np.trace(whole) / len(whole)))
    mistake = None
    if not (refit or unknown) and (not judged.as_calibrated or judged.instrument == "evident"):
        mistake = misread_visit(model, poses, expected, compared)
    if mistake is None and judged.verdict in ("recalibrate", "noisier_readings"):
        mistake = disagreeing_poses(judged, poses, compared)
    at_reference = None
    if reference is not None and not (absolute.as_calibrated and judged.as_calibrated):
        at_reference = against_calibration(reference)
    ranges, targets = robot.blocks["calibration"].ranges, poses.targets
    found = Recheck(
        model=model,
        poses=poses,
        judged=judged,
        absolute=absolute if relative is not None else None,
        limits=detection_limits(judged.test, SHIFT),
        tools=(),
        telling=None,
        expected=expected,
        outside=outside_ranges(robot, poses.q),
        warm=warm,
        mistake=mistake,
        fitted=fitted_points(robot, poses),
        at_reference=at_reference,
        unmatched=reference is not None and relative is None,
    )
    suspects = found.shown.suspects
    return replace(
        found,
        tools=tuple(moved_tool(model, ranges, suspect, targets) for suspect in suspects),
        telling=telling_pose(model, ranges, (suspects[0], suspects[1]), targets)
        if len(suspects) > 1
        else None,
    )


def without_implausible_temperatures(robot: CalibratedRobot, poses: PoseSet) -> PoseSet:
    """Poses without those whose temperature cannot be the arm's, where the calibrated robot depends on it, and a note on them."""
    if not depends_on_temperature(robot.model):
        return poses
    return with_plausible_temperatures(poses, plausible_temperatures(poses))


def _reference_temperature(robot: CalibratedRobot, poses: PoseSet, reference: PoseSet) -> tuple[str, ...]:
    """What is to be said of a reference visit without temperature; where both visits have none, the visit's own remark says it."""
    if (
        reference.temperature is not None
        or poses.temperature is None
        or not depends_on_temperature(robot.model)
    ):
        return ()
    return (
        f"the reference visit has no temperature and is taken as of {reference_temperature(robot.model):.1f} °C; if the arm was warmer or "
        "colder then, that shows as thermal growth: make a reference visit with its temperature (--reference)",
    )


def _require(robot: CalibratedRobot, poses: PoseSet) -> None:
    unmeasured = [name for name in poses.targets if name not in robot.measured]
    if unmeasured:
        raise FlexcalError(
            "E-RECHECK-006",
            f"no calibration pose measured {' and '.join(unmeasured)}, so its place on the tool is not known; measure "
            f"{' or '.join(robot.measured)}.",
        )
    if len(poses) < 4:
        raise FlexcalError(
            "E-RECHECK-007",
            f"{len(poses)} {'pose tells' if len(poses) == 1 else 'poses tell'} too little; measure four or more, better ten.",
        )
