"""docs/ros.md: its commands run as they stand, in a folder with what the page says is there."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from cheap_arm import CheapArm
from cli_files import read_csv, write_csv
from lerobot_files import calibration_file, record
from refusals import assert_refusal
from ur5_description import JOINTS, write_description
from xacro_robots import link_poses

from flexcal.cli.main import main
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.model.kinematics import point_kinematics, point_placement
from flexcal.model.robot import RobotModel

pytest.importorskip("xacro")


def commands(page: Path) -> list[str]:
    return re.findall(r"^\$ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)


def run(line: str) -> None:
    words = shlex.split(line)
    if words[0] == "flexcal":
        assert main(words[1:]) == 0, line
        return
    assert words[0] == "xacro"
    program, _, out = line.partition(" > ")
    made = subprocess.run(
        [sys.executable, "-c", "import xacro; xacro.main()", *shlex.split(program)[1:]],
        check=True,
        capture_output=True,
    )
    Path(out).write_bytes(made.stdout)


@pytest.fixture
def robot_folder(tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(examples / "ur5_tracker" / "robot.yaml", tmp_path)
    header, rows = read_csv(examples / "ur5_tracker" / "grid.csv")
    write_csv(tmp_path / "poses.csv", header, rows[::9])
    write_description(examples / "ur5_tracker" / "ur5.urdf", tmp_path)
    arm = CheapArm(13)
    arm.write(tmp_path / "arm")
    calibration_file(tmp_path / "motors.json")
    for name, count, seed in (("recorded", 50, 1), ("others", 40, 2)):
        record(arm, tmp_path / f"{name}.csv", count, seed)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_command_of_the_page_runs(
    root: Path, robot_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = {}
    for line in commands(root / "docs" / "ros.md"):
        run(line)
        said[line.rpartition("--out ")[2]] = capsys.readouterr().out
    text = " ".join(said["description"].split())
    assert "kinematics.upper_arm.roll, for rpy of shoulder_lift_joint" in text
    assert "wrote 2 files to description, 1 of them changed" in text and "Nothing is lost" in text
    verdict = " ".join(said["corrected.json"].split())
    page = (root / "docs" / "ros.md").read_text(encoding="utf-8")
    on_page = re.search(r"^zeros or geometry: .*$", page, re.MULTILINE)
    number = r"\d+(?:\.\d+)?"
    assert on_page is not None and re.sub(number, "#", on_page[0]) in re.sub(number, "#", verdict)
    numbers = [
        re.findall(number, text[text.index("zeros or geometry") :])[:5] for text in (on_page[0], verdict)
    ]
    np.testing.assert_allclose(*np.array(numbers, dtype=float), rtol=0.02)
    model = CalibratedRobot.from_yaml("robot.yaml", "calibration").probable
    assert_tool_as_calibrated(model, Path("calibrated.urdf").read_text(), np.zeros(6))
    run("xacro with_offsets/urdf/ur5.urdf.xacro > offsets.urdf")
    offsets = model.joint_offsets
    assert_tool_as_calibrated(model, Path("offsets.urdf").read_text(), offsets)
    limits = [
        yaml.safe_load(Path(folder, "config", "joint_limits.yaml").read_text())["joint_limits"]
        for folder in ("", "with_offsets")
    ]
    for joint, offset in zip(JOINTS, offsets, strict=True):
        for key in ("min_position", "max_position"):
            assert limits[1][joint][key] - limits[0][joint][key] == pytest.approx(offset, abs=1e-12)


def assert_tool_as_calibrated(model: RobotModel, urdf: str, shift: np.ndarray) -> None:
    carrier, point, _ = point_placement(model, "smr")
    for q in np.random.default_rng(2).uniform(-2, 2, (20, 6)):
        at = link_poses(urdf, dict(zip(JOINTS, q + shift, strict=True)))[model.joints[carrier].link]
        wanted = point_kinematics(model, q[None], jacobians=False).position[0]
        np.testing.assert_allclose(at[:3, :3] @ point + at[:3, 3], wanted, atol=1e-9)


def test_what_is_written_again_replaces_what_was_written_and_nothing_else(run, robot_folder: Path) -> None:
    """Files in folders below --out are protected as those in it are."""
    main, out = robot_folder / "urdf" / "ur5.urdf.xacro", robot_folder / "new"
    subprocess_xacro = [sys.executable, "-c", "import xacro; xacro.main()", str(main)]
    (robot_folder / "ur5.urdf").write_bytes(
        subprocess.run(subprocess_xacro, check=True, capture_output=True).stdout
    )
    arguments = ("export", "xacro", robot_folder / "robot.yaml", "--xacro", main, "--out", out)
    assert run(*arguments).status == 0 and run(*arguments).status == 0
    (out / "config" / "ur5_kinematics.yaml").write_text("mine\n")
    assert_refusal(run(*arguments).err, "E-CLI-013", "ur5_kinematics.yaml")
    assert (out / "config" / "ur5_kinematics.yaml").read_text() == "mine\n"
    linked = robot_folder / "linked"
    linked.mkdir()
    (linked / "config").symlink_to(robot_folder / "config")
    before = (robot_folder / "config" / "ur5_kinematics.yaml").read_bytes()
    assert_refusal(run(*arguments[:-1], linked).err, "E-ROS-045", "linked/config")
    assert (robot_folder / "config" / "ur5_kinematics.yaml").read_bytes() == before
    own = (*arguments[:-1], robot_folder)
    assert_refusal(run(*own).err, "E-CLI-013")


def test_other_input_that_cannot_be_used(run, robot_folder: Path) -> None:
    (robot_folder / "ur5.urdf").write_text((robot_folder / "urdf" / "ur5.urdf.xacro").read_text())
    base = ("export", "xacro", robot_folder / "robot.yaml", "--out", robot_folder / "new")
    sentence = run(*base, "--joint-limits", robot_folder / "config" / "joint_limits.yaml").err
    assert_refusal(sentence, "E-ROS-016", "joint_limits.yaml")
    assert_refusal(run(*base, "--arguments", "prefix=a").err, "E-ROS-018", "prefix=a")
    assert_refusal(run(*base, "--packages", "=here").err, "E-ROS-018")
    assert not (robot_folder / "new").exists()
