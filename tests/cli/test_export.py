"""`export …`: every format from the command line, what it says is lost, and what it refuses."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from refusals import assert_refusal
from test_bad_input import refused_run

from flexcal.model.robot import RobotModel

FORMATS = {
    "urdf": "calibrated.urdf",
    "mjcf": "calibrated.xml",
    "sdf": "calibrated.sdf",
    "dh": "dh.csv",
    "mdh": "mdh.csv",
    "offsets": "offsets.csv",
    "kinematics": "kinematics.yaml",
    "json": "calibrated.json",
}
RIGID = {"urdf", "sdf", "dh", "mdh", "kinematics"}


def test_every_format_of_a_calibrated_robot(run, ur5_folder: Path) -> None:
    """A calibration with nothing but geometry: all but the offsets carry it, and the offsets say what they leave."""
    robot = ur5_folder / "robot.yaml"
    run("calibrate", robot, ur5_folder / "grid.csv", "--terms", "kinematic")
    for name, file in FORMATS.items():
        out = ur5_folder / "exported" / file
        outcome = run("export", name, robot, "--out", out, "--json")
        assert outcome.status == 0, outcome.err
        document = outcome.document
        assert document["calibrated"] and document["file"] == str(out) and out.is_file()
        lost = [term["term"] for term in document["lost"]]
        if name == "offsets":
            assert lost == ["axis misalignments and lengths"]
            assert 0.05 < document["tool_error"]["mean_mm"] < document["tool_error"]["p95_mm"]
            assert document["tool_error"]["mean_mm"] < 0.8 * document["without_offsets"]["mean_mm"]
            joints = document["joints"]
            assert list(joints) == list(RobotModel.from_yaml(robot).joint_names)
            ends, middle = ("shoulder_pan_joint", "wrist_3_joint"), list(joints.values())[1:5]
            assert all(0 < joint["std"] < 1e-3 and joint["determined"] for joint in middle)
            for joint in (joints[name] for name in ends):
                assert joint["offset"] == 0.0 and not joint["determined"] and joint["std"] is None
        else:
            assert lost == [] and document["tool_error"]["max_mm"] < 1e-6
    page = run("export", "json", robot, "--out", ur5_folder / "exported" / FORMATS["json"])
    assert page.status == 0 and page.out.splitlines()[-1].startswith("next: read ")
    assert "Nothing is lost" in page.out and "the joint placements are nominal" not in page.out


@pytest.mark.parametrize("name", sorted(RIGID | {"offsets"}))
def test_what_is_lost_stands_in_the_file_and_on_the_page(run, tx90l_folder: Path, name: str) -> None:
    out = tx90l_folder / FORMATS[name]
    page = run("export", name, tx90l_folder / "robot.yaml", "--out", out)
    said = [line for line in page.out.splitlines() if line.startswith(("This format", "The tool is off"))]
    assert len(said) == 2 and "elastic deflection" in said[0] and " mm in 95 % of poses" in said[1]
    assert "; the nominal robot, its base and point fitted, is off by " in said[1]
    text = out.read_text()
    assert all(sentence in text for sentence in said)
    assert "the joint placements are nominal" in page.out and page.out.splitlines()[-1].startswith(
        "next: flexcal calibrate"
    )


def test_tables_are_tables(run, tx90l_folder: Path) -> None:
    robot = tx90l_folder / "robot.yaml"
    run("export", "mdh", robot, "--out", tx90l_folder / "mdh.csv")
    lines = [line for line in (tx90l_folder / "mdh.csv").read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert len(rows) == 6 * 5 + 2 * 6 and {row["unit"] for row in rows} == {"rad", "m"}
    for row in rows:
        change = float(row["calibrated"]) - float(row["nominal"])
        if row["unit"] == "rad":
            change = math.remainder(change, 2 * math.pi)
        assert change == pytest.approx(float(row["difference"]))
    page = run("export", "offsets", robot, "--out", tx90l_folder / "offsets.csv", "--keep-frames")
    assert "with these frames" not in page.out and "\nbase," not in (tx90l_folder / "offsets.csv").read_text()


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("own", ["robot.yaml", "tx90l.urdf", "frequency_poses.csv"])
def test_a_robots_own_file_is_no_place_for_an_export(run, tx90l_folder: Path, name: str, own: str) -> None:
    arguments = ("export", name, tx90l_folder / "robot.yaml", "--out", tx90l_folder / own)
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-CLI-013")


def test_what_flexcal_wrote_is_protected_while_it_is_the_robot(run, tx90l_folder: Path) -> None:
    run("export", "urdf", tx90l_folder / "robot.yaml", "--out", tx90l_folder / "new.urdf")
    robot = tx90l_folder / "new.yaml"
    robot.write_text(
        (tx90l_folder / "robot.yaml").read_text().replace("tx90l.urdf", "new.urdf").replace("smr:", "seen:")
    )
    sentence = refused_run(run, tx90l_folder, "export", "urdf", robot, "--out", tx90l_folder / "new.urdf")
    assert_refusal(sentence, "E-RUN-021", "nominal URDF")


@pytest.mark.parametrize("name", ["dh", "mdh", "offsets", "kinematics"])
def test_a_chain_needs_a_point(run, tx90l_folder: Path, name: str) -> None:
    robot = tx90l_folder / "robot.yaml"
    lines = robot.read_text().splitlines(keepends=True)
    robot.write_text("".join(line for line in lines if not line.startswith(("points:", "  smr:"))))
    sentence = refused_run(run, tx90l_folder, "export", name, robot, "--out", tx90l_folder / "new")
    assert_refusal(sentence, "E-EXPORT-001")


def test_other_input_that_cannot_be_used(run, tx90l_folder: Path, examples: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "new"
    sentence = refused_run(run, tx90l_folder, "export", "dh", robot, "--point", "tool", "--out", out)
    assert_refusal(sentence, "E-ROBOT-041", "tool", "smr")
    missing = refused_run(run, tx90l_folder, "export", "mjcf", robot, "--estimates", "nowhere", "--out", out)
    assert_refusal(missing, "E-RUN-022", "nowhere")
    massless = refused_run(
        run, tx90l_folder, "export", "mjcf", examples / "tx40" / "robot.yaml", "--out", out
    )
    assert_refusal(massless, "E-EXPORT-002", "tx40.urdf")
    assert_refusal(refused_run(run, tx90l_folder, "export", "sdf", robot, "--out", tx90l_folder), "E-CLI-010")
    assert_refusal(
        refused_run(run, tx90l_folder, "export", "step", robot, "--out", out), "E-CLI-041", "export", "step"
    )
