"""`flexcal recheck` on files: visits kept one after the other, plans, refusals."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv, write_csv
from refusals import assert_refusal
from stranger_arm import SIX, StrangerArm

from flexcal.cli.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, examples: Path) -> Path:
    """The real UR5, calibrated on a fifth of its poses; ten of the others are a visit, with noise of its own in each file."""
    home = tmp_path_factory.mktemp("ur5")
    shutil.copytree(examples / "ur5_tracker", home, dirs_exist_ok=True)
    header, rows = read_csv(home / "grid.csv")
    write_csv(home / "poses.csv", header, rows[::5])
    assert main(["calibrate", str(home / "robot.yaml"), str(home / "poses.csv"), "--terms", "kinematic"]) == 0
    rng = np.random.default_rng(4)
    for name in ("reference", "first", "second"):
        visit = rows[27::100].copy()
        visit[:, -3:] += 2e-5 * rng.normal(size=(10, 3))
        write_csv(home / f"{name}.csv", header, visit)
    visit[:, header.index("q3")] -= 1.5e-3
    write_csv(home / "shifted.csv", header, visit)
    return home


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict:
    capsys.readouterr()
    assert main(["recheck", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_visits_are_kept_and_compared_with_the_first(folder: Path, capsys) -> None:
    robot, home = folder / "robot.yaml", folder / "recheck"
    first = said(capsys, robot, folder / "reference.csv", "--date", "2026-01-10")
    assert "this visit is now the reference" in " ".join(first["remarks"])
    assert first["recheck"]["compared"] == "calibration" and first["recheck"]["verdict"] == "as_calibrated"
    for name, day in (("first", "2026-02-10"), ("second", "2026-03-10")):
        document = said(capsys, robot, folder / f"{name}.csv", "--date", day)
        assert document["recheck"]["reference"] == "2026-01-10"
        assert document["recheck"]["verdict"] == "as_calibrated"
    assert document["drift"]["visits"] == ["2026-01-10", "2026-02-10", "2026-03-10"]
    # the same files again are the same visit
    again = said(capsys, robot, folder / "second.csv", "--date", "2026-03-11")
    assert "are the visit of 2026-03-10 already" in " ".join(again["remarks"])
    # and so is a copy of them, in another order of rows
    header, rows = read_csv(folder / "second.csv")
    write_csv(folder / "copy.csv", header, rows[::-1])
    copied = said(capsys, robot, folder / "copy.csv", "--date", "2026-03-12")
    assert "the same readings are the visit of 2026-03-10 already" in " ".join(copied["remarks"])
    stored = json.loads((home / "visits.json").read_text("utf-8"))
    assert [visit["date"] for visit in stored["visits"]] == ["2026-01-10", "2026-02-10", "2026-03-10"]
    assert [visit["reference"] for visit in stored["visits"]] == [True, False, False]
    assert again["recheck"]["probability"] == document["recheck"]["probability"]

    shifted = said(capsys, robot, folder / "shifted.csv", "--date", "2026-04-10")
    best = shifted["recheck"]["suspects"][0]
    change = best["changes"]["elbow_joint.offset"]
    assert best["subject"] == "elbow_joint" and change["low"] < 1.5e-3 < change["high"]
    assert best["tool_mm"]["mean"] > 0.3
    assert json.loads((home / "results.json").read_text("utf-8")) == shifted
    page = (home / "report.html").read_text("utf-8")
    assert "figure-drift" in page and "elbow_joint shifted by" in page.replace("Elbow", "elbow")
    # a visit that was measured before does not see the later ones
    assert len(said(capsys, robot, folder / "first.csv", "--date", "2026-02-10")["drift"]["visits"]) == 2


def test_a_new_calibration_begins_anew_and_keeps_the_visits(folder: Path, tmp_path: Path, capsys) -> None:
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    shutil.rmtree(tmp_path / "recheck", ignore_errors=True)
    robot = tmp_path / "robot.yaml"
    said(capsys, robot, tmp_path / "reference.csv")
    header, rows = read_csv(tmp_path / "grid.csv")
    write_csv(tmp_path / "others.csv", header, rows[1::5])
    assert main(["calibrate", str(robot), str(tmp_path / "others.csv"), "--terms", "kinematic"]) == 0
    document = said(capsys, robot, tmp_path / "first.csv")
    assert document["recheck"]["compared"] == "calibration" and len(document["drift"]["visits"]) == 1
    assert len(json.loads((tmp_path / "recheck" / "visits.json").read_text("utf-8"))["visits"]) == 2


def test_a_plan_states_what_it_finds(folder: Path, tmp_path: Path, capsys) -> None:
    document = said(capsys, folder / "robot.yaml", "--plan", 8, "--out", tmp_path)
    found = {
        name: {joint: item["found_95_percent"] for joint, item in block["joints"].items()}
        for name, block in document["power"].items()
    }
    assert document["poses"] == 8 and (tmp_path / "plan.yaml").is_file()
    assert found["reference"]["wrist_3_joint"] is None  # the point lies on its axis
    assert found["reference_repeated"]["elbow_joint"] < found["reference"]["elbow_joint"] < 1e-3
    assert found["reference_refit"]["shoulder_pan_joint"] is None


def test_poses_of_the_calibration_do_not_judge_it(folder: Path, tmp_path: Path, capsys) -> None:
    document = said(capsys, folder / "robot.yaml", folder / "poses.csv", "--out", tmp_path)
    assert "was fitted to 200 of these 200 points, so they cannot judge it" in document["sentence"]


@pytest.mark.parametrize(
    ("arguments", "code", "names"),
    [
        (["first.csv", "--date", "10.2.2026"], "E-RECHECK-009", ["10.2.2026"]),
        (["--plan", "3"], "E-RECHECK-008", ["3 poses"]),
        (["first.csv", "--plan", "8"], "E-RECHECK-010", ["--plan"]),
        ([], "E-CLI-007", ["POSES"]),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(
    folder: Path, capsys, monkeypatch, arguments, code, names
) -> None:
    monkeypatch.chdir(folder)
    assert main(["recheck", "robot.yaml", *arguments]) == 2
    assert_refusal(capsys.readouterr().err, code, *names)


@pytest.mark.parametrize(
    ("content", "code"),
    [
        ("{", "E-FILE-023"),
        ('{"kind": "visits", "schema": 2}', "E-RECHECK-003"),
        ('{"kind": "visits", "schema": 1, "robot": "ur5", "visits": [{"date": 3}]}', "E-RECHECK-004"),
        ('{"kind": "visits", "schema": 1, "robot": "kr6", "visits": []}', "E-RECHECK-005"),
    ],
)
def test_damaged_visits_are_refused(tmp_path: Path, content: str, code: str) -> None:
    from flexcal.errors import InputError
    from flexcal.jobs.recheck import VISITS, read_visits

    (tmp_path / VISITS).write_text(content, "utf-8")
    with pytest.raises(InputError) as caught:
        read_visits(tmp_path, "ur5")
    assert caught.value.code == code and VISITS in str(caught.value)


def test_visits_out_of_order_are_said_to_be(folder: Path, tmp_path: Path, capsys) -> None:
    """A visit before the reference, one between others, and one in the future; the line on visits.json counts all."""
    robot = folder / "robot.yaml"

    def remarks(name: str, day: str) -> str:
        return " ".join(said(capsys, robot, folder / name, "--date", day, "--out", tmp_path)["remarks"])

    assert "this visit is now the reference" in (told := remarks("reference.csv", "2026-03-10"))
    assert "(--reference)" not in told and "visits.json says" not in told
    early = remarks("first.csv", "2026-02-10")
    assert "now the reference" not in early and "dated before the reference visit of 2026-03-10" in early
    assert "judged without" not in early
    stored = json.loads((tmp_path / "visits.json").read_text("utf-8"))["visits"]
    assert [visit["reference"] for visit in stored] == [False, True]
    assert "in the future" in remarks("second.csv", "2931-04-01")
    between = remarks("shifted.csv", "2026-05-10")
    assert "of 2931-04-01 was judged without this visit; recheck those files again" in between
    capsys.readouterr()
    arguments = ["recheck", str(robot), str(folder / "first.csv"), "--out", str(tmp_path)]
    assert main(arguments) == 0 and ": 4 visits since this calibration" in capsys.readouterr().out


def test_readings_rounded_to_more_than_they_scatter(tmp_path: Path, run) -> None:
    """Repeated readings are equal then, and what their digits can carry is what they are known to; without any noise nothing is tested."""
    arm, rng = StrangerArm(3, axes=tuple(SIX)), np.random.default_rng(3)
    robot, q, visited = (
        arm.write(tmp_path),
        arm.postures(40, rng),
        np.repeat(arm.postures(10, rng), 3, axis=0),
    )

    def written(name: str, q: np.ndarray, sigma: float, decimals: int = 4) -> Path:
        readings = arm.measured(q, rng, sigma=sigma).round(decimals)
        return arm.write_poses(tmp_path / f"{name}.csv", q, readings, sigma=None)

    def visit(day: int, file: Path):
        return run("recheck", robot, file, "--date", f"2026-01-{day:02d}", "--out", tmp_path / "visits")

    assert run("calibrate", robot, written("points", q, 3e-6)).status == 0
    for day in (1, 2):
        assert "as calibrated" in visit(day, written(f"visit{day}", visited, 3e-6)).out
    arm.zeros = arm.zeros + np.array([0, 3e-4, 0, 0, 0, 0])
    assert re.search(r"a2 shifted by \+0\.(29|30)", visit(3, written("shifted", visited, 3e-6)).out)
    assert run("calibrate", robot, written("exact", q, 0.0, 17)).status == 0
    assert_refusal(visit(4, written("exact_visit", visited, 0.0, 17)).err, "E-RECHECK-002", "sigma")
