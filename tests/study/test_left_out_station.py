"""Stations left out one after the other: parameters are compared where they mean the same, of an arm that shares nothing with flexcal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from dh_arm import DHArm, postures, tracked, write_robot

from flexcal.cli.main import main
from flexcal.files.formats import write_yaml


def test_another_first_station_is_no_spread_of_the_others(tmp_path: Path) -> None:
    """Three trackers with the noise that they state, and a robot as modelled: nothing spreads more than the fit says."""
    rng = np.random.default_rng(8)
    robot, arm = write_robot(tmp_path), DHArm.made(9)
    robot.write_text(robot.read_text() + "stations: {one: {}, two: {}, three: {}}\n")
    lines = [",".join(["pose", *(f"q{k}" for k in range(1, 7)), "x", "y", "z", "sigma", "station"])]
    for station in ("one", "two", "three"):
        q = postures(rng, 24)
        for row, point in zip(q, tracked(arm.points(q), rng, 2e-5), strict=True):
            lines.append(
                ",".join([str(len(lines)), *map(repr, [*row.tolist(), *point.tolist()]), "2e-5", station])
            )
    (tmp_path / "points.csv").write_text("\n".join(lines) + "\n")
    study = tmp_path / "study.yaml"
    write_yaml(
        study,
        {
            "kind": "calibrate",
            "robot": "robot.yaml",
            "poses": ["points.csv"],
            "options": {"terms": ["kinematic"]},
            "resampling": {"leave_one_out": "station"},
        },
    )
    assert main(["study", str(study), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0
    block = json.loads((tmp_path / "out" / "results.json").read_text("utf-8"))["resampling"]
    assert block["surely_larger"] == []
    places = {name: item for name, item in block["parameters"].items() if name.startswith("station.")}
    assert places and max(item["ratio"] for item in places.values()) < 5
    assert len(block["parameters"]) > 30
