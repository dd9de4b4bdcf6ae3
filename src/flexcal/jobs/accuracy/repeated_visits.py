"""Pose accuracy and repeatability of a robot from repeated visits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import (
    CYCLES,
    VISITS_PER_SET,
    PoseDrift,
    PoseRepeatability,
    common_displacement,
    noise_repeatability,
    pose_drifts,
    visit_statistics,
)
from flexcal.calibration.measurement import predicted_positions
from flexcal.calibration.verification import uncalibrated_model
from flexcal.data.poses import PoseSet, read_poses
from flexcal.files.formats import provenance
from flexcal.jobs.calibration import ignored_columns_remarks
from flexcal.jobs.inputs import (
    CalibratedRobot,
    is_station_identified,
    require_distinct_files,
    stored_estimates,
)
from flexcal.jobs.pages import PlottedFolder
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import Page
from flexcal.report.pages import RepeatabilityStudy, repeatability_page
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False, repr=False)
class Repeatability(PlottedFolder):
    """Result of `repeatability`: pose accuracy and repeatability of ISO 9283:1998 from repeated visits.

    Attributes
    ----------
    model : RobotModel
        The nominal robot.
    poses : PoseSet
        All measured points.
    visited : list of PoseRepeatability
        The poses that were visited twice or more, in the order of their first visits: `rows` of their visits, `repeatability` RP, m,
        `direction_variation` vAP, m.
    errors : mapping of ndarray
        Measured minus commanded (N, 3), m, by how the command is understood: "nominal", the nominal robot's own, with instrument and
        measured point registered by best fit; "calibrated", the calibrated robot's.
    drifts : list of PoseDrift
        Drift of the poses that were visited often enough while a clock ran.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    poses: PoseSet
    visited: list[PoseRepeatability]
    errors: Mapping[str, np.ndarray]
    drifts: list[PoseDrift]
    record: RunRecord = NOT_RECORDED

    @property
    def headline(self) -> str:
        """Repeatability RP over the poses, and their number."""
        rp = [pose.repeatability / MILLIMETRE for pose in self.visited]
        return (
            f"RP {np.mean(rp):.3f} mm on average, {np.max(rp):.3f} mm at most, of {len(rp)} poses that were visited "
            f"{sum(len(pose.rows) for pose in self.visited)} times"
        )

    def summary(self) -> str:
        """RP, AP as the nominal and the calibrated robot, and remarks."""
        document = self.document()
        accuracy = [
            f"AP of the {kind} robot {spread['mean']:.3f} mm on average, {spread['max']:.3f} mm at most"
            for kind in self.errors
            if (spread := document[f"ap_{kind}_mm"]) is not None
        ]
        return "\n".join([self.headline, *accuracy, *self.remarks])

    def _page(self) -> Page:
        return repeatability_page(
            RepeatabilityStudy(self.model.name, self.poses, self.visited, self.document())
        )

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, one sentence each."""
        timed = self.poses.time is not None
        remarks = [*self.poses.notes, *ignored_columns_remarks(replace(self.poses, time=None))]
        if timed and not self.drifts:
            remarks.append(
                f"drift is evaluated at poses with {2 * VISITS_PER_SET} visits or more, with times that increase from row to row "
                "and file to file"
            )
        fewest = min(len(pose.rows) for pose in self.visited)
        if fewest < CYCLES:
            remarks.append(
                f"ISO 9283 asks for {CYCLES} visits to each pose; there are {fewest} at the pose with the fewest, so RP is less certain"
            )
        once = len(self.poses) - sum(len(pose.rows) for pose in self.visited)
        if once:
            remarks.append(f"{once} rows are of poses that were visited once; they are not used")
        if "nominal" not in self.errors:
            remarks.append(
                "too few poses for a registration of the nominal robot, so its pose accuracy is not known: visit four or more"
            )
        if "calibrated" not in self.errors:
            remarks.append(
                "there is no calibration, or not from this station, so the calibrated robot's pose accuracy is not known"
            )
        return tuple(remarks)

    def document(self) -> dict[str, Any]:
        """The content of results.json: over all poses, and each of them."""
        rows = [self._pose(pose) for pose in self.visited]
        keys = ["rp_mm", "vap_mm", *(f"ap_{kind}_mm" for kind in self.errors)]
        return {
            **header("repeatability"),
            "poses": len(rows),
            "visits": {
                "fewest": min(row["visits"] for row in rows),
                "total": sum(row["visits"] for row in rows),
            },
            **{key: _spread([row[key] for row in rows if row[key] is not None]) for key in keys},
            "instrument_rp_mm": noise_repeatability(self.poses.sigma) / MILLIMETRE
            if self.poses.sigma_given
            else None,
            "drift": self._drift(),
            "each": rows,
            "remarks": list(self.remarks),
            **self.record.document(),
        }

    def _drift(self) -> dict[str, Any] | None:
        """dRP, dAP and the way of the barycentres over all poses, and the course of each; None where none is known."""
        if not self.drifts:
            return None
        each = []
        for drift in self.drifts:
            first = int(drift.sets[0][0])
            courses = {
                f"ap_{kind}_mm": drift.accuracy(errors) / MILLIMETRE for kind, errors in self.errors.items()
            }
            each.append(
                {
                    "pose": int(self.poses.pose[first]),
                    "target": str(self.poses.target[first]),
                    "t_s": drift.time.tolist(),
                    "rp_mm": (drift.repeatability / MILLIMETRE).tolist(),
                    "way_mm": (np.linalg.norm(drift.way, axis=1) / MILLIMETRE).tolist(),
                    **{key: course.tolist() for key, course in courses.items()},
                    "drp_mm": drift.repeatability_drift / MILLIMETRE,
                    **{
                        f"dap_{kind}_mm": drift.accuracy_drift(errors) / MILLIMETRE
                        for kind, errors in self.errors.items()
                    },
                    "certain": drift.certain,
                }
            )
        together, apart = common_displacement(self.drifts)
        keys = ["drp_mm", *(f"dap_{kind}_mm" for kind in self.errors)]
        return {
            **{key: _spread([item[key] for item in each]) for key in keys},
            "way_mm": _spread([item["way_mm"][-1] for item in each]),
            "together_mm": together / MILLIMETRE,
            "apart_mm": apart / MILLIMETRE,
            "each": each,
        }

    def _pose(self, pose: PoseRepeatability) -> dict[str, Any]:
        first = int(pose.rows[0])
        return {
            "pose": int(self.poses.pose[first]),
            "target": str(self.poses.target[first]),
            "visits": len(pose.rows),
            "rp_mm": pose.repeatability / MILLIMETRE,
            "rp_rotation_rad": pose.rotation,
            "vap_mm": None if pose.direction_variation is None else pose.direction_variation / MILLIMETRE,
            **{f"ap_{kind}_mm": pose.accuracy(e) / MILLIMETRE for kind, e in self.errors.items()},
        }


def repeatability(
    model: RobotModel,
    poses: PoseSet,
    *,
    calibrated: CalibratedRobot | None = None,
    progress: Progress = silent,
) -> Repeatability:
    """Determine pose accuracy and repeatability (ISO 9283:1998, 7.2) from repeated visits to the same commanded poses.

    Rows belong to one pose where joint positions, target, station and payload are the same, whatever number they have. RP needs no
    calibration.

    Parameters
    ----------
    model : RobotModel
        Nominal robot.
    poses : PoseSet
        Measured points, with repeated visits; with times, the drift of poses that were visited often is evaluated.
    calibrated : CalibratedRobot, optional
        The robot whose pose accuracy AP is determined besides; `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Repeatability
        Its `visited` poses with RP each, `summary()`, `report(path)` and `write(folder)`.

    Raises
    ------
    FlexcalError
        For measured lengths, and where no pose was visited twice.

    Examples
    --------
    Three visits to each of two poses of the virtual cell:

    >>> import numpy as np
    >>> from flexcal import PosePlan, RobotModel, VirtualCell, repeatability
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> q = np.array([[0, -0.5, 1.6, 0, 0.6, 0], [0.5, 0.2, 1.4, 0.3, 0.8, 0]])
    >>> measured = VirtualCell(model).measure(PosePlan(q=np.tile(q, (3, 1))))
    >>> [pose.rows.tolist() for pose in repeatability(model, measured).visited]
    [[0, 2, 4], [1, 3, 5]]
    """
    progress("visits", 0.0)
    visited = visit_statistics(poses)
    progress("visits", 0.5)
    errors: dict[str, np.ndarray] = {}
    before = uncalibrated_model(model, poses).errors(poses).robots_own
    if before is not None:
        errors["nominal"] = before
    if calibrated is not None and all(is_station_identified(calibrated.model, s) for s in poses.stations):
        errors["calibrated"] = poses.position - predicted_positions(calibrated.model, poses)
    progress("visits", 1.0)
    return Repeatability(model, poses, visited, errors, pose_drifts(poses, visited))


def robot_repeatability(
    robot_file: Path,
    files: Sequence[Path],
    *,
    estimates: Path | None = None,
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Repeatability:
    """`repeatability` of the robot of a robot.yaml by files of measured poses; with `out`, results.json and report.html are left there.

    `estimates` is an estimates.yaml, or a folder with one; without, that beside robot.yaml is used where it holds a calibration. Raises
    `FlexcalError` as reading and `repeatability` do.
    """
    require_distinct_files(files)
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    progress("reading", 0.0)
    poses = read_poses(list(files), nominal, require_motion=False)
    progress("reading", 1.0)
    calibrated = _calibrated(robot_file, estimates, nominal)
    evaluated = repeatability(nominal, poses, calibrated=calibrated, progress=progress)
    stored = None if calibrated is None else calibrated.stored
    blocks = () if calibrated is None else tuple(calibrated.blocks)
    origin = provenance([robot_file, nominal.urdf, *files], None, stored, blocks)
    result = replace(evaluated, record=RunRecord(origin, command))
    if out is not None:
        result.write(out)
    return result


def _calibrated(robot_file: Path, estimates: Path | None, nominal: RobotModel) -> CalibratedRobot | None:
    """Calibrated robot; None if none was named and none lies beside robot.yaml."""
    if estimates is None and not stored_estimates(nominal, None).exists():
        return None
    return CalibratedRobot.from_yaml(robot_file, estimates)


def _spread(values: Sequence[float]) -> dict[str, float] | None:
    """Mean and largest over the poses; None where there are none."""
    return {"mean": float(np.mean(values)), "max": float(np.max(values))} if values else None
