"""Points that are the robot's in another size, of no known unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from dh_arm import DHArm, postures, tracked, write_poses, write_robot
from refusals import assert_refusal

from flexcal.cli.main import main


def test_yards_are_told_as_a_size_without_a_factor_that_was_fitted(tmp_path: Path, capsys) -> None:
    rng = np.random.default_rng(2)
    robot, q = write_robot(tmp_path), postures(rng, 30)
    points = tracked(DHArm.made(3).points(q), rng, 3e-5)
    file = write_poses(tmp_path / "p.csv", q, points / 0.9144, None)
    assert main(["import", str(robot), str(file), "--out", str(tmp_path / "out.csv")]) == 2
    told = capsys.readouterr().err
    assert_refusal(told, "E-CLI-035", "0.914 times as large")
    assert "--map 'x=" not in told and not (tmp_path / "out.csv").exists()
