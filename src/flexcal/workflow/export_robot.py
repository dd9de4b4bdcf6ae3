"""The calibrated robot in a form that other programs read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.errors import InputError
from flexcal.export.urdf import UrdfExport, write_urdf
from flexcal.model import RobotModel
from flexcal.model.stored import apply_estimates
from flexcal.units import MILLIMETRE


@dataclass(frozen=True)
class ExportedRobot:
    """What was written; `calibrated` is False where there were no estimates and the nominal robot was exported."""

    export: UrdfExport
    calibrated: bool

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "file": self.export.path,
            "calibrated": self.calibrated,
            "lost": list(self.export.lost),
            "mean_loss_mm": self.export.mean_loss / MILLIMETRE,
            "max_loss_mm": self.export.max_loss / MILLIMETRE,
            "remarks": list(self.export.remarks),
        }


def export_urdf(robot: Path, out: Path, *, estimates: Path | None = None) -> ExportedRobot:
    """Write the robot with its estimates as URDF; `estimates` is a file or folder in place of that beside robot.yaml.

    Raises `FlexcalError` as reading and `write_urdf` do, and where `out` is the robot's own URDF.
    """
    model = RobotModel.from_yaml(robot, estimates=False)
    if out.exists() and model.urdf.exists() and out.samefile(model.urdf):
        raise InputError(f"{out} is the nominal URDF of {robot}, which is never changed; give another --out.")
    path = model.path.parent / model.config.estimates if estimates is None else estimates
    path = path / "estimates.yaml" if path.is_dir() else path
    if estimates is not None and not path.exists():
        raise InputError(f"{path} does not exist; run 'flexcal calibrate' first, or leave --estimates out.")
    calibrated = path.exists()
    if calibrated:
        model = apply_estimates(model, path)
    return ExportedRobot(write_urdf(model, out), calibrated)
