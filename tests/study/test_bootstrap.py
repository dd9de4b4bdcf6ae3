"""Bootstraps of measurements whose stated uncertainties differ, of an arm that shares nothing with flexcal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_robot

from flexcal.cli.main import main
from flexcal.files.formats import write_yaml


@pytest.mark.xfail(strict=True, reason="what tolerances tell does not scatter with the data: 0.4 for 1")
@pytest.mark.parametrize("seed", [3, 4])
def test_a_reading_scatters_by_its_own_sigma_in_every_bootstrap(seed: int, tmp_path: Path) -> None:
    """Half of the readings are ten times as uncertain, as they say: the estimates spread as the fit states, within chance."""
    rng = np.random.default_rng(seed)
    write_robot(tmp_path)
    q = postures(rng, 30)
    exact = tracked(DHArm.made(seed).points(q), rng, 0.0)
    lines = [",".join(["pose", *(f"q{k}" for k in range(1, 7)), "x", "y", "z", "sigma"])]
    for number, (row, point) in enumerate(zip(q, exact, strict=True)):
        sigma = (1e-5, 1e-4)[number % 2]
        values = [*row.tolist(), *(point + rng.normal(0, sigma, 3)).tolist(), sigma]
        lines.append(",".join([str(number), *map(repr, values)]))
    (tmp_path / "points.csv").write_text("\n".join(lines) + "\n")
    study = {"kind": "calibrate", "robot": "robot.yaml", "poses": ["points.csv"]}
    study |= {"options": {"terms": ["kinematic"], "loss": "squares"}, "resampling": {"bootstrap": 20}}
    write_yaml(tmp_path / "study.yaml", study)
    assert main(["study", str(tmp_path / "study.yaml"), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0
    block = json.loads((tmp_path / "out" / "results.json").read_text("utf-8"))["resampling"]
    assert 0.7 < block["ratio"] < 1.3 and block["surely_larger"] == []
