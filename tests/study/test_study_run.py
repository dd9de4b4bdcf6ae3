"""Studies that run, are interrupted, and go on."""

from __future__ import annotations

import errno
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from polars.testing import assert_frame_equal
from refusals import assert_refusal, refused
from small_study import UR5, stored, write_study

from flexcal.cli.main import main
from flexcal.jobs.study import read_study, run_study, store
from flexcal.jobs.study.tasks import run_row
from flexcal.parallel import ThisProcess, open_workers


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small study, task after task in this process."""
    folder = tmp_path_factory.mktemp("whole")
    run_study(read_study(write_study(folder)), folder / "out", ThisProcess())
    return folder / "out"


def test_processes_and_a_cluster_give_the_same_bits(whole: Path, dask_address: str, tmp_path: Path) -> None:
    plan = read_study(write_study(tmp_path))
    for name, on, jobs in (("processes", None, 2), ("dask", dask_address, 1)):
        with open_workers(on, jobs) as workers:
            run_study(plan, tmp_path / name, workers)
        assert_frame_equal(stored(tmp_path / name), stored(whole), check_exact=True)


@pytest.mark.parametrize("kind", ["virtual_calibration", "calibrate"])
def test_tasks_need_no_files(kind: str, tmp_path: Path) -> None:
    """As on the worker of another machine: robot and measurements are sent."""
    folder = tmp_path / "robot"
    shutil.copytree(UR5, folder)
    given: dict[str, object] = {"robot": "robot.yaml", "kind": kind}
    if kind == "calibrate":
        given |= {"poses": ["random.csv"], "resampling": {"jackknife": 20}, "options": {"terms": ["offsets"]}}
        given |= {"seeds": None, "grid": None}
    plan = read_study(write_study(folder, **given))
    expected = run_row(plan.rows[1], plan.tasks)
    sent = pickle.dumps(plan.tasks)
    shutil.rmtree(folder)
    assert run_row(plan.rows[1], pickle.loads(sent)) == expected


def test_a_row_a_task_and_a_page(whole: Path) -> None:
    rows = stored(whole)
    assert rows["number"].to_list() == [0, 1, 2, 3] and rows["error"].null_count() == 4
    assert rows["option.poses"].to_list() == [10, 10, 12, 12] and rows["seed"].to_list() == [1, 2, 1, 2]
    document = json.loads((whole / "results.json").read_text())
    assert document["kind"] == "study" and document["tasks"] == {"total": 4, "done": 4, "failed": 0}
    name = "elbow_joint.length_x"
    held = (rows[f"{name}.low"] <= rows[f"{name}.truth"]) & (rows[f"{name}.truth"] <= rows[f"{name}.high"])
    assert document["coverage"]["parameters"][name]["inside"] == held.sum()
    page = (whole / "report.html").read_text()
    assert "Coverage of the 95 % intervals" in page and "What drives the error" in page
    assert not (whole / "tasks.jsonl").exists()


def test_a_task_that_fails_is_a_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = write_study(tmp_path, grid={"poses": [10, 2]}, seeds={"count": 1})
    assert main(["study", str(study), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    rows = stored(tmp_path / "out")
    assert rows["error"].is_null().to_list() == [True, False]
    assert rows["error_code"][1].startswith("E-") and rows["error"][1] in said
    assert rows["error"][1][:40] in (tmp_path / "out" / "report.html").read_text()


def test_a_study_whose_tasks_all_fail_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = write_study(tmp_path, grid={"poses": [2]}, seeds={"count": 2})
    assert main(["study", str(study), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 2
    assert_refusal(capsys.readouterr().err, "E-STUDY-024", "all 2 tasks")
    assert stored(tmp_path / "out")["error"].null_count() == 0


def test_ctrl_c_says_how_to_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*given: object, **options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("flexcal.jobs.study.run_study", interrupt)
    assert main(["study", str(write_study(tmp_path)), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 130
    assert "--resume" in capsys.readouterr().out


KILLED_AT_THE_THIRD_ROW = """
import os, signal, sys
import flexcal.jobs.study.store as store
from flexcal.cli.main import main

rows, append_rows = iter(range(4)), store.append_rows

def append(*given, **options):
    if next(rows) == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    append_rows(*given, **options)

store.append_rows = append
sys.exit(main(sys.argv[1:]))
"""


def test_a_killed_study_goes_on_where_it_stopped(whole: Path, tmp_path: Path) -> None:
    study = write_study(tmp_path)
    arguments = ["study", str(study), "--out", str(tmp_path / "out"), "--jobs", "1"]
    killed = subprocess.run([sys.executable, "-c", KILLED_AT_THE_THIRD_ROW, *arguments], check=False)
    assert killed.returncode == -signal.SIGKILL
    rows = (tmp_path / "out" / "tasks.jsonl").read_text().splitlines()
    assert len(rows) == 2 and not (tmp_path / "out" / "report.html").exists()
    assert main(["report", str(tmp_path / "out")]) == 0  # of what there is
    assert "the study is not complete" in (tmp_path / "out" / "report.html").read_text()
    with (tmp_path / "out" / "tasks.jsonl").open("a") as stream:
        stream.write(rows[0][:100])  # torn
    assert counted(tmp_path / "out", study, resume=True) == 2
    assert_frame_equal(stored(tmp_path / "out"), stored(whole), check_exact=True)


def counted(folder: Path, study: Path, *, resume: bool) -> int:
    """Number of tasks that ran."""
    shares: list[float] = []
    run_study(
        read_study(study),
        folder,
        ThisProcess(),
        resume=resume,
        progress=lambda _, share: shares.append(share),
    )
    return len(shares) - 1


@pytest.mark.parametrize("damage", ["cut", "other", "empty"])
def test_a_damaged_row_is_named_and_its_task_runs_again(
    damage: str, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, rows = interrupted(tmp_path, after=3), tmp_path / "out" / "tasks.jsonl"
    first, second, third = rows.read_text().splitlines()
    second = {"cut": second[: len(second) // 2], "other": "x" * 100, "empty": ""}[damage]
    rows.write_text(f"{first}\n{second}\n{third}\n")
    document = run_study(read_study(study), tmp_path / "out", ThisProcess(), resume=True)
    assert len(document["remarks"]) == 1 and str(rows) in document["remarks"][0]
    assert_frame_equal(stored(tmp_path / "out"), stored(whole), check_exact=True)


def interrupted(folder: Path, after: int) -> Path:
    """A study that Ctrl-C ends after so many tasks."""
    study = write_study(folder)
    calls = iter(range(100))

    def stop(stage: str, share: float) -> None:
        if next(calls) == after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(read_study(study), folder / "out", ThisProcess(), progress=stop)
    return study


def test_a_full_disk_loses_nothing_that_was_stored(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, calls = store.append_rows, iter(range(100))

    def full(*given: Any, **options: Any) -> None:
        if next(calls) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        append(*given, **options)

    monkeypatch.setattr("flexcal.jobs.study.store.append_rows", full)
    study = write_study(tmp_path)
    with refused("E-STUDY-017", "No space left on device", "2", "4", "--resume"):
        run_study(read_study(study), tmp_path / "out", ThisProcess())
    assert counted(tmp_path / "out", study, resume=True) == 2
    assert_frame_equal(stored(tmp_path / "out"), stored(whole), check_exact=True)


def test_a_study_goes_on_with_further_rows_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = interrupted(tmp_path, after=2), tmp_path / "out"
    with refused("E-STUDY-019", "--resume"):
        run_study(read_study(study), out, ThisProcess())
    write_study(tmp_path, options={"verification_poses": 11})
    with refused("E-STUDY-023", "2"):
        run_study(read_study(study), out, ThisProcess(), resume=True)
    robot = tmp_path / "other" / "robot.yaml"
    shutil.copytree(UR5, robot.parent)
    robot.write_text(robot.read_text() + "# changed\n")
    write_study(tmp_path, robot=str(robot))
    with refused("E-STUDY-022", "input.robot.yaml"):
        run_study(read_study(study), out, ThisProcess(), resume=True)
    write_study(tmp_path, grid={"poses": [9, 10, 12]})
    document = run_study(read_study(study), out, ThisProcess(), resume=True)
    assert document["tasks"]["done"] == 6
    assert stored(out)["option.poses"].to_list() == [9, 9, 10, 10, 12, 12]


def test_two_studies_in_one_folder_are_refused(tmp_path: Path) -> None:
    study = read_study(write_study(tmp_path))

    def again(stage: str, share: float) -> None:
        with refused("E-STUDY-018", str(tmp_path / "out")):
            run_study(study, tmp_path / "out", ThisProcess())
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "out", ThisProcess(), progress=again)


def test_results_of_another_verb_stay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "results.json").write_text('{"kind": "calibration", "schema": 1}')
    study = write_study(tmp_path)
    assert main(["study", str(study), "--out", str(out), "--resume"]) == 2
    assert_refusal(capsys.readouterr().err, "E-STUDY-021", str(out))
    assert main(["study", str(study), "--out", str(out), "--on", "dask://nowhere"]) == 2
    assert_refusal(capsys.readouterr().err, "E-WORK-006", "dask://nowhere")


def test_a_data_set_that_is_resampled(tmp_path: Path) -> None:
    given = {
        "kind": "calibrate",
        "seeds": None,
        "grid": None,
        "options": {"terms": ["offsets"], "loss": "squares"},
    }
    study = write_study(tmp_path, **given, poses=[str(UR5 / "random.csv")], resampling={"jackknife": 2})
    document = run_study(read_study(study), tmp_path / "out", ThisProcess())
    assert document["tasks"] == {"total": 3, "done": 3, "failed": 0} and document["coverage"] is None
    rows = stored(tmp_path / "out")
    assert rows["left_out.p90_mm"].is_null().to_list() == [True, False, False]
    assert document["resampling"]["kind"] == "jackknife" and document["resampling"]["resamples"] == 2
    units = {name: item["unit"] for name, item in document["resampling"]["parameters"].items()}
    assert units["elbow_joint.offset"] == "rad" and units["station.tracker.x"] == "m"
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<td>mrad</td>" in page and "<td>mm</td>" in page
