"""Provenance of pages that are based on the current robot model."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flexcal.files.formats import provenance, read_estimates
from flexcal.model.robot import RobotModel


def robot_provenance(model: RobotModel, files: Iterable[Path] = ()) -> dict[str, str]:
    """Program version, and SHA-256 of robot.yaml, its URDF, all blocks of its estimates, if any, and the `files`."""
    stored = model.path.parent / model.config.estimates
    blocks = tuple(read_estimates(stored)) if stored.exists() else ()
    return provenance([model.path, model.urdf, *files], estimates=stored, blocks=blocks)
