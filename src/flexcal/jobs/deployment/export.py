"""Export of the calibrated robot to file formats of other programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.calibration.fit import probable_robots
from flexcal.errors import InputError
from flexcal.export import (
    Convention,
    ExportedFile,
    RenderedModel,
    render,
    render_dh,
    render_offsets,
    undetermined_offsets,
    write_rendered,
)
from flexcal.files.formats import read_estimates
from flexcal.jobs.inputs import measured_points, stored_estimates
from flexcal.model.robot import RobotModel, with_blocks


@dataclass(frozen=True, eq=False)
class Exportable:
    """The `nominal` robot and the calibrated `model`; the posterior of `unseen` has only what the `measured` points leave undetermined."""

    nominal: RobotModel
    model: RobotModel
    unseen: RobotModel | None
    measured: tuple[str, ...]

    @property
    def undetermined(self) -> tuple[int, ...]:
        """Joints whose zero positions the measured points do not determine; with an instrument's own frame the base is free."""
        if not self.measured:
            return ()
        registered = bool(self.model.stations.pose[:, 3:].any())
        return undetermined_offsets(self.nominal, self.measured, base=registered)


Render = Callable[[Exportable], RenderedModel]
"""Function from a robot to the text of a file."""


@dataclass(frozen=True)
class ExportedRobot:
    """Exported file; `calibrated` is False without a calibration: the joints are then those of the nominal robot."""

    export: ExportedFile
    calibrated: bool

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        loss = self.export.loss
        return {
            "file": self.export.path,
            "calibrated": self.calibrated,
            "lost": [
                {"term": term.name} | (term.error.in_millimetres() if term.error else {})
                for term in loss.terms
            ],
            "tool_error": loss.error.in_millimetres() | {"poses": loss.poses, "within": loss.within}
            if loss.error
            else None,
            "remarks": list(self.export.remarks),
            **self.export.table,
        }


def export_robot(robot_file: Path, out: Path, format: str, *, estimates: Path | None = None) -> ExportedRobot:
    """Write the robot with its estimates in a plain format; `estimates` is a file or folder in place of that beside robot.yaml.

    Raises `FlexcalError`, as every export here, as reading and the format's rendering do, and where `out` is one of the robot's own files.
    """
    return _export(robot_file, out, estimates, lambda robot_: render(format, robot_.model, robot_.nominal))


def export_dh(
    robot_file: Path,
    out: Path,
    convention: Convention,
    *,
    point: str | None = None,
    four_parameters: bool = False,
    estimates: Path | None = None,
) -> ExportedRobot:
    """Write the Denavit-Hartenberg table of the chain to a point; see `render_dh`."""

    def rendered(robot_: Exportable) -> RenderedModel:
        return render_dh(
            robot_.model,
            robot_.nominal,
            convention,
            point=point,
            four_parameters=four_parameters,
            unseen=robot_.unseen,
        )

    return _export(robot_file, out, estimates, rendered)


def export_offsets(
    robot_file: Path,
    out: Path,
    *,
    point: str | None = None,
    keep_frames: bool = False,
    estimates: Path | None = None,
) -> ExportedRobot:
    """Write the best joint offsets of the chain to a point; see `render_offsets`."""

    def rendered(robot_: Exportable) -> RenderedModel:
        return render_offsets(
            robot_.model,
            robot_.nominal,
            point=point,
            keep_frames=keep_frames,
            undetermined=robot_.undetermined,
        )

    return _export(robot_file, out, estimates, rendered)


def _export(robot_file: Path, out: Path, estimates: Path | None, rendered: Render) -> ExportedRobot:
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    path = stored_estimates(nominal, estimates)
    for own, what in ((nominal.urdf, "nominal URDF"), (robot_file, "robot.yaml"), (path, "estimates file")):
        if out.exists() and own.exists() and out.samefile(own):
            raise InputError(
                "E-RUN-021",
                f"{out} is the {what} of {robot_file}, which is never changed; give another --out.",
            )
    if estimates is not None and not path.exists():
        raise InputError(
            "E-RUN-022", f"{path} does not exist; run 'flexcal calibrate' first, or leave --estimates out."
        )
    stored = path.exists()
    blocks = read_estimates(path) if stored else {}
    model = with_blocks(nominal, blocks, path) if stored else nominal
    measured = measured_points(nominal, blocks)
    probable, unseen = probable_robots(model, measured) if measured else (model, None)
    exportable = Exportable(nominal, probable, unseen, measured)
    return ExportedRobot(write_rendered(probable, out, rendered(exportable)), "calibration" in blocks)
