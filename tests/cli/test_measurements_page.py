"""The examples of docs/measurements.md are read as they stand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from stranger_readings import ReadArm

from flexcal import PoseSet, RobotModel, read_poses

MASK = {
    "Points": "located",
    "Full poses": "turned",
    "Wires": "far",
    "Sockets": "in_socket",
    "Inclinometers": "tilted",
    "Known forces": "located",
}


def sections(root: Path) -> dict[str, tuple[str, str]]:
    """YAML and rows of every kind on the page."""
    found = {}
    for part in (root / "docs" / "measurements.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        blocks = dict(re.findall(r"```(yaml|text)\n(.*?)```", part, re.DOTALL))
        if blocks:
            found[part.splitlines()[0]] = blocks.get("yaml", ""), blocks.get("text", "")
    return found


def test_every_kind_of_the_table_has_an_example(root: Path) -> None:
    text = (root / "docs" / "measurements.md").read_text(encoding="utf-8")
    linked = re.findall(r"^\| \[[^\]]+\]\(#([\w-]+)\)", text, re.MULTILINE)
    assert {name.lower().replace(" ", "-") for name in sections(root)} == set(linked)


@pytest.mark.parametrize(
    "kind",
    [
        "Points",
        "Full poses",
        "Wires",
        "Planes and dial gauges",
        "Lines",
        "Spheres",
        "Sockets",
        "Inclinometers",
        "Known forces",
    ],
)
def test_the_example_is_read(root: Path, tmp_path: Path, kind: str) -> None:
    declared, rows = sections(root)[kind]
    model = RobotModel.from_yaml(ReadArm.drawn(3).write(tmp_path, declared))
    (tmp_path / "rows.csv").write_text(rows)
    poses = read_poses(tmp_path / "rows.csv", model, require_motion=False)
    assert isinstance(poses, PoseSet) and len(poses) == len(rows.splitlines()) - 1
    assert np.all(getattr(poses, MASK[kind]) if kind in MASK else poses.kind != "")
    assert poses.sigma_given == (kind != "Sockets")


def test_the_camera_of_the_page_is_declared(root: Path, tmp_path: Path) -> None:
    declared, _ = sections(root)["Cameras"]
    model = RobotModel.from_yaml(ReadArm.drawn(3).write(tmp_path, declared))
    assert model.config.measurements["eye"].kind == "camera"
