"""`--out` never touches what somebody else wrote, and a verb that fails leaves nothing behind."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from cli_files import snapshot
from refusals import assert_refusal, refused
from test_bad_input import refused_run

from flexcal.cli.folders.overwrite_protection import outputs
from flexcal.errors import InputError
from flexcal.files.transaction import LEDGER, write_text


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("name", ["robot.yaml", "frequency_poses.csv", "notes.txt"])
def test_a_users_file_is_no_place_for_a_plan(run, tx90l_folder: Path, name: str) -> None:
    (tx90l_folder / "notes.txt").write_text("mine")
    arguments = ("design", "frequency", tx90l_folder / "robot.yaml", "--out", tx90l_folder / name)
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-CLI-013")


def test_a_users_measurements_are_not_replaced(run, tx90l_folder: Path, tmp_path: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tmp_path / "mine"
    plan = tmp_path / "plan.yaml"
    assert run("design", "poses", robot, "--random", "--count", 3, "--out", plan).status == 0
    out.mkdir()
    (out / "poses.csv").write_text("pose,q1\n1,0\n")
    measure = ("measure", plan, "--robot", robot, "--cell", "virtual", "--out")
    assert_refusal(refused_run(run, tmp_path, *measure, out), "E-CLI-013", "mine/poses.csv")
    assert run(*measure, tmp_path / "new").status == 0
    first = snapshot(tmp_path / "new")
    assert run(*measure, tmp_path / "new").status == 0
    assert snapshot(tmp_path / "new") == first
    with (tmp_path / "new" / "poses.csv").open("a") as stream:
        stream.write("\n")
    assert_refusal(refused_run(run, tmp_path, *measure, tmp_path / "new"), "E-CLI-013")


def test_demo_does_not_touch_a_robots_estimates(run, tx90l_folder: Path) -> None:
    (tx90l_folder / "estimates.yaml").write_text("calibration: {values: {}}\n")
    assert_refusal(
        refused_run(run, tx90l_folder, "demo", "--out", tx90l_folder), "E-CLI-013", "estimates.yaml"
    )


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/none/such"])
def test_a_place_that_is_no_folder(run, tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("mine")
    sentence = refused_run(run, tmp_path, "demo", "--out", tmp_path / place)
    assert_refusal(sentence, "E-CLI-011", place)


def test_folders_that_are_missing_are_made(tmp_path: Path) -> None:
    with outputs("demo", tmp_path / "a" / "b", ("x*",)):
        write_text(tmp_path / "a" / "b" / "x1", "1")
    assert (
        tmp_path / "a" / "b" / LEDGER
    ).read_text() == f"# flexcal demo\n{sha256(tmp_path / 'a' / 'b' / 'x1')}  x1\n"
    assert sorted(p.name for p in (tmp_path / "a" / "b").iterdir()) == [LEDGER, "x1"]


def test_what_an_earlier_run_left_goes(tmp_path: Path) -> None:
    """Three responses of a new plan among six of an old one would be fitted together."""
    (tmp_path / "other").write_text("mine")
    for count in (6, 3):
        with outputs("demo", tmp_path, ("x*",)):
            for k in range(count):
                write_text(tmp_path / f"x{k}", str(count))
    assert sorted(p.name for p in tmp_path.iterdir()) == [LEDGER, "other", "x0", "x1", "x2"]


@pytest.mark.parametrize("problem", [InputError("E-TEST-001", "no"), KeyboardInterrupt()])
def test_a_verb_that_fails_leaves_nothing(tmp_path: Path, problem: BaseException) -> None:
    with pytest.raises(type(problem)), outputs("demo", tmp_path / "a" / "b", ("x*", "y")):
        write_text(tmp_path / "a" / "b" / "x1", "1")
        raise problem
    assert list(tmp_path.iterdir()) == []


def test_a_verb_that_fails_changes_nothing(tmp_path: Path) -> None:
    with outputs("demo", tmp_path, ("x", "y")):
        write_text(tmp_path / "x", "1")
    before = snapshot(tmp_path)
    with pytest.raises(InputError), outputs("demo", tmp_path, ("x", "y")):
        write_text(tmp_path / "x", "2")
        write_text(tmp_path / "y", "2")
        raise InputError("E-TEST-001", "no")
    assert snapshot(tmp_path) == before
    with outputs("demo", tmp_path, ("x", "y")):
        write_text(tmp_path / "x", "3")
    assert (tmp_path / "x").read_text() == "3"


def test_results_of_two_verbs_do_not_share_a_folder(run, ur5_folder: Path) -> None:
    robot, out, poses = ur5_folder / "robot.yaml", ur5_folder / "out", ur5_folder / "random.csv"
    assert run("calibrate", robot, poses, "--terms", "kinematic", "--out", out).status == 0
    sentence = refused_run(run, ur5_folder, "verify", robot, poses, "--estimates", out, "--out", out)
    assert_refusal(sentence, "E-CLI-014", "calibrate", "a folder")
    # the page alone may be made anew from the numbers, and the same verb may be run again
    assert run("report", out).status == 0
    assert run("calibrate", robot, poses, "--terms", "kinematic", "--out", out).status == 0
    assert_refusal(
        refused_run(run, ur5_folder, "verify", robot, poses, "--estimates", out, "--out", out),
        "E-CLI-014",
        "calibrate",
    )
    digests = {}
    for line in (out / LEDGER).read_text().splitlines():
        if not line.startswith("#"):
            digest, name = line.split("  ")
            digests[name] = digest
    assert digests == {name: sha256(out / name) for name in digests} and "report.html" in digests


def test_measurements_do_not_replace_the_plan_of_the_same_name(tmp_path: Path) -> None:
    plan = tmp_path / "poses.csv"
    with outputs("design poses", plan, page=True):
        write_text(plan, "plan")
    with refused("E-CLI-014", "design poses") as caught, outputs("import", plan):
        write_text(plan, "measured")
    assert "give 'flexcal import' a file of its own" in str(caught.value)
    assert plan.read_text() == "plan"


def test_a_ledger_without_verbs_hinders_none(tmp_path: Path) -> None:
    """As flexcal wrote it before it noted them."""
    (tmp_path / "x").write_text("1")
    (tmp_path / LEDGER).write_text(f"{sha256(tmp_path / 'x')}  x\n")
    with outputs("demo", tmp_path, ("x",)):
        write_text(tmp_path / "x", "2")
    with refused("E-CLI-014", "demo"), outputs("verify", tmp_path, ("x",)):
        pass


@pytest.mark.parametrize(
    "words",
    ["calibrate robot.yaml none.csv", "identify dynamics robot.yaml none.csv", "identify stiffness robot.yaml none",
     "identify inertials robot.yaml none"],
)  # fmt: skip
def test_another_programs_covariances_are_seen_before_the_work(run, tx90l_folder: Path, words: str) -> None:
    """Before the measurements are read: these are not even there."""
    out = tx90l_folder / "out"
    out.mkdir()
    (out / "estimates.npz").write_bytes(b"mine")
    arguments = [
        tx90l_folder / word if word.startswith(("robot", "none")) else word for word in words.split()
    ]
    assert_refusal(
        refused_run(run, tx90l_folder, *arguments, "--out", out), "E-FILE-010", "out/estimates.npz"
    )


def test_another_programs_file_is_no_learned_residual(run, tx90l_folder: Path) -> None:
    pytest.importorskip("sklearn", reason="scikit-learn (the extra 'learn') is not installed")
    (tx90l_folder / "learned_residual.npz").write_bytes(b"mine")
    robot, log = tx90l_folder / "robot.yaml", tx90l_folder / "none.csv"
    sentence = refused_run(run, tx90l_folder, "identify", "dynamics", robot, log, "--learn-residual")
    assert_refusal(sentence, "E-FILE-010", "learned_residual.npz")
