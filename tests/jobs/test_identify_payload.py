"""A payload of the virtual robot that robot.yaml has wrong, from design to compensated commands."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.jobs.experiments import measure
from flexcal.jobs.experiments.measurement import VIRTUAL
from flexcal.jobs.payload import identify_robot_payload


@pytest.mark.slow
def test_a_payload_that_is_a_fifth_heavier(tmp_path: Path) -> None:
    """Ten seconds on the robot tell it to half a per cent and half a millimetre, and the tool's error under it goes by a factor of ten."""
    from benchmarks.payload import design, one_seed

    design(tmp_path)
    found = one_seed(21, tmp_path)
    for way in ("block", "free"):
        assert abs(found[way]["payload.mass"][0]) < 0.04
        assert max(abs(found[way][f"payload.com_{key}"][0]) for key in "xyz") < 1e-3
        assert found["tool"][way] < 0.1 * found["tool"]["declared"]
        scores = np.array([error / std for error, std, _ in found[way].values()])
        assert np.abs(scores).max() < 4.0


def test_folders_are_taken_as_they_were_planned(examples: Path, tmp_path: Path) -> None:
    """One trajectory of half a second, with and without payload, given the wrong way round."""
    for name in ("robot.yaml", "tx90l.urdf"):
        (tmp_path / name).write_bytes((examples / "tx90l" / name).read_bytes())
    robot = tmp_path / "robot.yaml"
    for name, payload in (("loaded", "null"), ("free", "0.0")):
        zeros = [[0.0]] * 6
        (tmp_path / f"{name}.yaml").write_text(
            "kind: trajectory\nname: short\npaths:\n  centre: [[0.1, 0.5, 0.7, 0.1, 0.4, 0.1]]\n"
            f"  sine: [{zeros}]\n  cosine: [{[[0.1]] * 6}]\nbase_frequency_hz: 2.0\nperiods: 2\nsettle_periods: 1\n"
            "kp: [3000, 3000, 800, 300, 100, 60]\nkd: [400, 400, 100, 20, 8, 4]\nrate_hz: 4000\ntau: held\nseed: 0\n"
            + ("" if payload == "null" else f"payload: {payload}\n")
        )
        measure(robot, tmp_path / f"{name}.yaml", VIRTUAL, tmp_path / name)
    with refused("E-RUN-068"):
        identify_robot_payload(robot, [tmp_path / "free"], free=[tmp_path / "loaded"])
    with refused("E-RUN-069"):
        identify_robot_payload(robot, [tmp_path / "loaded"], free=[tmp_path / "loaded"])
    with refused("E-RUN-064"):
        identify_robot_payload(robot, [tmp_path / "loaded"])
