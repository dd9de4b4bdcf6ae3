"""Points that were read at another instant than the joints of an arm in motion, by an arm of rows that shares nothing with flexcal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dh_arm import HOME, DHArm, postures, tracked, write_poses, write_robot

from flexcal import Calibration, RobotModel, calibrate, read_poses, verify

SIGMA = 3e-5


def _path(seed: int, times: np.ndarray) -> np.ndarray:
    """Joint positions (N, 6) of a slow continuous motion, about a turn of every joint in a minute."""
    rng = np.random.default_rng(seed)
    rate, phase = 2 * np.pi * rng.uniform(0.01, 0.03, 6), rng.uniform(0, 6, 6)
    return HOME + np.array([1.2, 0.6, 0.6, 1.4, 0.8, 2.0]) * np.sin(times[:, None] * rate + phase)


def _calibrated(folder: Path, q: np.ndarray, there: np.ndarray, times: np.ndarray | None) -> Calibration:
    """The arm calibrated on rows with joint positions `q`, whose points were read at the positions `there`."""
    rng = np.random.default_rng(5)
    file = write_poses(folder / "points.csv", q, tracked(DHArm.made(4).points(there), rng, SIGMA), SIGMA)
    if times is not None:
        lines = file.read_text().splitlines()
        column = ["t", *map(repr, times.tolist())]
        file.write_text(
            "\n".join(f"{line},{value}" for line, value in zip(lines, column, strict=True)) + "\n"
        )
    model = RobotModel.from_yaml(write_robot(folder), estimates=False)
    return calibrate(model, read_poses([file], model))


@pytest.mark.parametrize(("delay", "timed"), [(0.05, True), (-0.02, False)])
def test_points_of_a_moving_arm_are_no_scatter_of_it(tmp_path: Path, delay: float, timed: bool) -> None:
    """The lag is found in its size and sign, the result is not trusted, and no floor is laid on the arm."""
    times = np.linspace(0, 600, 120)
    result = _calibrated(tmp_path, _path(1, times), _path(1, times - delay), times if timed else None)
    lag = result.lag
    assert lag is not None and lag.certain and lag.timed == timed
    step = 1.0 if timed else times[1]
    assert abs(lag.lag * step - delay) < 0.04 * abs(delay)
    remarks = result.document()["remarks"]
    remark = next(text for text in remarks if "the joint positions by" in text)
    assert ("lag behind" in remark) == (delay > 0)
    assert not any("is most of what is left" in text for text in remarks)
    assert result.trust.status == "bad" and "lag" in result.trust.reasons


def test_an_arm_that_stands_still_has_no_lag(tmp_path: Path) -> None:
    """Along a path, where it scatters as if by friction too; and at poses in no order, which tell nothing."""
    times = np.linspace(0, 600, 120)
    q = _path(2, times)
    assert (still := _calibrated(tmp_path, q, q, times).lag) is not None and not still.certain
    stays_behind = 5e-4 * np.sign(_path(2, times + 0.1) - q)
    assert (wound := _calibrated(tmp_path, q, q - stays_behind, times).lag) is not None and not wound.certain
    scattered = postures(np.random.default_rng(3), 60)
    assert _calibrated(tmp_path, scattered, scattered, None).lag is None


def test_a_good_calibration_is_not_blamed_for_points_of_a_moving_arm(tmp_path: Path) -> None:
    """Verified on a path whose points lag: the lag is told, and none where the arm stood still at each."""
    times = np.linspace(0, 600, 120)
    rng = np.random.default_rng(6)
    scattered = postures(rng, 50)
    result = _calibrated(tmp_path, scattered, scattered, None)
    # the tracker, which is drawn first, stands where it stood at the calibration
    for delay in (0.05, 0.0):
        seen = DHArm.made(4).points(np.vstack([scattered, _path(3, times - delay)]))
        seen = tracked(seen, np.random.default_rng(5), SIGMA)[50:]
        file = write_poses(tmp_path / "path.csv", _path(3, times), seen, SIGMA)
        lines = [
            f"{line},{t}"
            for line, t in zip(file.read_text().splitlines(), ["t", *times.tolist()], strict=True)
        ]
        file.write_text("\n".join(lines) + "\n")
        verified = verify(result.robot, read_poses([file], result.robot.model))
        assert verified.lag is not None and verified.lag.certain == (delay > 0)
        assert ("lag" in verified.trust.reasons) == (delay > 0)
        if delay:
            assert abs(verified.lag.lag - delay) < min(0.04 * delay, 3 * verified.lag.std)
