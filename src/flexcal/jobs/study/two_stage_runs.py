"""Two-stage calibrations of virtual robots."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

from flexcal.design.scene import CollisionChecker
from flexcal.files.formats import provenance
from flexcal.files.transaction import read_bytes
from flexcal.jobs.study.measured_values import error_columns, fit_columns, parameter_columns
from flexcal.jobs.study.options import TwoStageOptions, structured
from flexcal.jobs.study.rows import StudyRow
from flexcal.jobs.study.tasks import StudyTasks
from flexcal.jobs.two_stage import TwoStageRun, run_two_stage
from flexcal.model.robot import RobotModel


@dataclass(frozen=True)
class TwoStageRuns(StudyTasks):
    """Runs the demonstration on the robot drawn from the seed; `contents` are those of its files, by path below their common folder."""

    robot: str
    contents: Mapping[str, bytes]
    settings: Mapping[str, Any]
    origin: Mapping[str, str]
    options: ClassVar[type] = TwoStageOptions
    has_truth: ClassVar[bool] = True

    @classmethod
    def of(cls, robot: Path, model: RobotModel, settings: Mapping[str, Any]) -> TwoStageRuns:
        """Tasks on the robot of a robot.yaml, with the files that the demonstration needs: settings, obstacles and meshes too."""
        beside = [
            robot.parent / name for name in ("cell.yaml", "frequency_poses.csv", *model.config.obstacles)
        ]
        meshes = [Path(item.meshPath) for item in CollisionChecker(model).geometry.geometryObjects]
        paths = list(
            dict.fromkeys(
                Path(os.path.abspath(path))
                for path in (robot, model.urdf, *beside, *meshes)
                if path.is_file()
            )
        )
        # package://name/ is in a folder of its name
        common = Path(os.path.commonpath([path.parent for path in paths])).parent
        contents = {path.relative_to(common).as_posix(): read_bytes(path) for path in paths}
        return cls(paths[0].relative_to(common).as_posix(), contents, settings, provenance(paths))

    @property
    def cell(self) -> Mapping[str, Any]:
        """As `StudyTasks.cell`."""
        return self.settings

    def result(self, row: StudyRow) -> dict[str, Any]:
        """As `StudyTasks.result`."""
        options = structured(row.options, TwoStageOptions, self.settings)
        with TemporaryDirectory(prefix="flexcal_study_") as folder:
            for name, content in self.contents.items():
                path = Path(folder, "robot", name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            run = run_two_stage(
                Path(folder, "robot", self.robot),
                Path(folder, "out"),
                seed=row.seed,
                plan=options.plan,
                cell=options.cell_kind,
                config=options.cell,
                inertias_known=options.inertias_known,
                report=False,
            )
        return _columns(run)


def _columns(run: TwoStageRun) -> dict[str, Any]:
    calibration = run.calibration
    springs, verdict = run.stiffness.estimate, run.trust.document()
    columns = {
        **error_columns("verification", run.elastic_verification.all),
        **error_columns("measured", run.measured_verification.all),
        **error_columns("rigid", run.rigid_verification[0].all),
        **error_columns("nominal", run.nominal_verification.all),
        **error_columns("fit", calibration.errors),
        **fit_columns(calibration.estimate, calibration.variances),
        "responses.reduced_chi2": springs.reduced_chi2,
        "trusted": verdict["trusted"],
        "reasons": " ".join(verdict["reasons"]),
        "total_s": float(sum(run.seconds.values())),
    }
    for estimate in (run.dynamics, calibration.estimate, springs):
        if estimate is not None:  # what stage 2 estimates again is told as stage 1 has it
            columns |= parameter_columns(estimate, run.truth)
    return columns
