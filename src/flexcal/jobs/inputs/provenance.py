"""Provenance of pages that are based on the current robot model."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from flexcal.data.poses import images_of
from flexcal.files.formats import provenance, read_estimates, sha256_of
from flexcal.model.robot import RobotModel


def robot_provenance(model: RobotModel, files: Iterable[Path] = ()) -> dict[str, str]:
    """Program version, and SHA-256 of robot.yaml, its URDF, all blocks of its estimates, if any, and the `files`."""
    stored = model.estimates_file
    blocks = tuple(read_estimates(stored)) if stored.exists() else ()
    return provenance([model.path, model.urdf, *files], estimates=stored, blocks=blocks)


def image_provenance(tables: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of the names and contents of all images together that each of the `tables` names."""
    origin = {}
    for table in tables:
        images = images_of(table)
        if images:
            digest = hashlib.sha256()
            for image in images:
                digest.update(f"{image.name}\0{sha256_of(image)}\n".encode())
            origin[f"input.{len(images)} images of {table.name}"] = digest.hexdigest()
    return origin
