"""`flexcal fleet` on folders written by other means than flexcal's."""

from __future__ import annotations

import json
import os
from datetime import datetime
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import polars as pl
import pytest
from fleet_files import write_calibration, write_robot, write_verification, write_visits_of_recheck
from refusals import assert_refusal, refused

from flexcal.cli.main import main
from flexcal.jobs.fleet import Fleet, gather_fleet, review_fleet
from flexcal.jobs.fleet.projects import date_of

DAYS = ("2024-01-10", "2024-07-01", "2025-01-12", "2025-06-30", "2026-01-05")


def robot_named(fleet: Fleet | dict[str, Any], name: str) -> dict[str, Any]:
    document = fleet.document() if isinstance(fleet, Fleet) else fleet
    (robot,) = [item for item in document["robots"] if item["robot"] == name]
    return robot


def write_visits(folder: Path, errors: tuple[float, ...], *, name: str, calibration: str = "c") -> None:
    """A robot's verifications, mm, on the days."""
    for day, error in zip(DAYS, errors, strict=False):
        write_verification(folder / day, error, data=f"{name} {day}", calibration=calibration, freedom=1200.0)


def test_table_has_every_value_with_its_source(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fleet = tmp_path / "fleet"
    write_robot(fleet / "hall_1" / "arm", serial="007", tolerance=2e-4)
    folder = fleet / "hall_1" / "arm" / "2026-03-01_after_repair"
    write_calibration(folder, {"j1.offset": (1e-3, 1e-4), "j2.length_x": (2e-3, 1e-4)}, data="a")
    write_verification(folder / "checked", 0.1, data="b")
    out = tmp_path / "fleet.parquet"
    assert main(["fleet", str(fleet), "--out", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["counts"] | {"robots": 1, "within": 1, "problems": 0} == document["counts"]
    assert "007" in (tmp_path / "fleet.html").read_text("utf-8")
    table = pl.read_parquet(out)
    row = table.row(by_predicate=pl.col("name") == "j1.offset", named=True)
    assert (row["robot"], row["model"], row["kind"]) == ("007", "scara", "calibration")
    assert (row["value"], row["std"], row["unit"]) == (1e-3, 1e-4, "rad")
    assert str(row["date"]) == "2026-03-01 00:00:00"
    assert row["file"] == "hall_1/arm/2026-03-01_after_repair/estimates.yaml"
    p90 = table.row(by_predicate=pl.col("name") == "error.p90", named=True)
    assert p90["value"] == pytest.approx(1e-4) and p90["unit"] == "m" and p90["independent"]
    assert str(p90["date"]) == "2026-03-01 00:00:00"


def test_a_file_of_no_reasonable_size_is_not_hashed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fleet = tmp_path / "fleet"
    for name in "ab":
        write_robot(fleet / name)
        write_calibration(fleet / name / "2026-03-01", {"j1.offset": (1e-3, 1e-4)}, data=name)
    os.truncate(fleet / "a" / "2026-03-01" / "estimates.yaml", 10**10)
    start = process_time()
    main(["fleet", str(fleet), "--out", str(tmp_path / "fleet.csv")])
    assert "has 10 GB" in capsys.readouterr().out and process_time() - start < 3


def test_the_table_is_of_the_kind_that_its_name_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_robot(tmp_path / "arm")
    write_calibration(tmp_path / "arm" / "2026-03-01", {"j1.offset": (1e-3, 1e-4)}, data="a")
    for name in ("fleet.csv", "fleet.parquet"):
        assert main(["fleet", str(tmp_path / "arm"), "--out", str(tmp_path / name)]) == 0
    lines = (tmp_path / "fleet.csv").read_text("utf-8").splitlines()
    table = [dict(zip(lines[0].split(","), line.split(","), strict=True)) for line in lines[1:]]
    (row,) = [row for row in table if row["name"] == "j1.offset"]
    assert (float(row["value"]), row["date"][:10]) == (1e-3, "2026-03-01")
    assert pl.read_parquet(tmp_path / "fleet.parquet").height == len(table)
    capsys.readouterr()
    assert main(["fleet", str(tmp_path / "arm"), "--out", str(tmp_path / "fleet.xlsx")]) == 2
    assert_refusal(capsys.readouterr().err, "E-TABLE-025", "fleet.xlsx", ".csv or .parquet")
    assert not (tmp_path / "fleet.xlsx").exists()


@pytest.mark.parametrize("millimetres", ["250", "0.00025", "-1"])
def test_a_tolerance_in_another_unit_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], millimetres: str
) -> None:
    write_robot(tmp_path / "arm")
    assert main(["fleet", str(tmp_path), f"--tolerance={millimetres}"]) == 2
    assert_refusal(capsys.readouterr().err, "E-CLI-049", f"{millimetres} mm", "in mm")


def test_quality_of_a_stiffness_fit(tmp_path: Path) -> None:
    write_robot(tmp_path / "arm")
    for name, chi2 in (("known", 3.5), ("unknown", None)):
        document = {
            "kind": "stiffness",
            "schema": 1,
            "fit": {"reduced_chi2": chi2, "status": "converged"},
            "verdict": {"trusted": False, "reasons": ["misfit"]},
            "provenance": {"program": "test", f"input.{name}.csv": name},
        }
        (tmp_path / "arm" / name).mkdir()
        (tmp_path / "arm" / name / "results.json").write_text(json.dumps(document), "utf-8")
    frame = gather_fleet(tmp_path).table.frame.filter(kind="stiffness")
    found = frame.filter(name="reduced_chi2").select("folder", "value", "text").rows()
    assert found == [("arm/known", 3.5, "converged"), ("arm/unknown", None, "converged")]
    assert frame.filter(name="trusted")["value"].to_list() == [0.0, 0.0]


def test_tolerance_is_judged_with_the_uncertainty_of_the_p90(tmp_path: Path) -> None:
    """Standard deviation of a P90 of 40 poses: 0.95/√120 of it, 8.7 %; a margin of 14 %."""
    for name, error in (("bad", 0.24), ("near", 0.21), ("good", 0.16)):
        write_robot(tmp_path / name, tolerance=2e-4)
        write_verification(tmp_path / name / "out", error, data=name)
    write_robot(tmp_path / "fitted", tolerance=2e-4)
    write_verification(tmp_path / "fitted" / "out", 0.1, data="f", fitted=True)
    write_robot(tmp_path / "none")
    write_verification(tmp_path / "none" / "out", 0.1, data="n")
    fleet = review_fleet(tmp_path)
    states = {item["robot"]: item["state"] for item in fleet.document()["robots"]}
    assert states == {
        "bad": "out",
        "near": "undecided",
        "good": "within",
        "fitted": "not_judged",
        "none": "not_judged",
    }
    assert robot_named(fleet, "none")["reason"] == "no tolerance"
    assert "fitted" in robot_named(fleet, "fitted")["reason"]
    judged = review_fleet(tmp_path, tolerance=3e-4)
    assert robot_named(judged, "none")["tolerance_from"] == "option"
    assert robot_named(judged, "bad")["tolerance_from"] == "robot.yaml"


def test_moved_instrument_is_no_bad_robot(tmp_path: Path) -> None:
    """verify found the instrument elsewhere: its errors say nothing of the robot, nor of a trend."""
    write_robot(tmp_path / "arm", tolerance=2e-4)
    write_visits(tmp_path / "arm", (0.1, 0.1, 0.1), name="a")
    assert robot_named(review_fleet(tmp_path), "arm")["state"] == "within"
    write_verification(tmp_path / "arm" / DAYS[3], 5.0, data="moved", moved=True)
    arm = robot_named(review_fleet(tmp_path), "arm")
    assert arm["state"] == "not_judged" and "station" in arm["reason"] and arm["trend"]["visits"] == 3


def test_date_of_a_growing_error(tmp_path: Path) -> None:
    """0.02 mm a half-year, from 0.10 mm: 0.2 mm after another half-year; a flat robot has no date, nor one with undated visits."""
    write_robot(tmp_path / "grows", tolerance=2e-4)
    write_visits(tmp_path / "grows", (0.100, 0.1196, 0.1405, 0.1597, 0.1802), name="g")
    write_robot(tmp_path / "flat", tolerance=2e-4)
    write_visits(tmp_path / "flat", (0.100, 0.104, 0.098, 0.103, 0.101), name="f")
    write_robot(tmp_path / "undated", tolerance=2e-4)
    for k, error in enumerate((0.10, 0.12, 0.14, 0.16)):
        write_verification(tmp_path / "undated" / f"visit_{k}", error, data=f"u{k}")
    fleet = review_fleet(tmp_path)
    grows = robot_named(fleet, "grows")
    assert grows["drifts"] and grows["trend"]["low"] < 0.04 < grows["trend"]["high"]
    assert grows["reaches"]["low"] < "2026-07-01" < grows["reaches"]["high"]
    assert "2026-05" < grows["reaches"]["date"] < "2026-09"
    for name in ("flat", "undated"):
        assert not robot_named(fleet, name)["drifts"] and robot_named(fleet, name)["reaches"] is None
    assert "0 of 3 dated" in robot_named(fleet, "undated")["outlook"]
    assert any("no date" in remark for remark in fleet.document()["remarks"])


def test_a_crash_between_two_verifications_is_said(tmp_path: Path) -> None:
    """Of four robots that scatter by a tenth, one has 0.88 mm after 0.07 mm; a bad verification that the next does not confirm is none."""
    write_robot(tmp_path / "crashed", tolerance=2e-4)
    write_visits(tmp_path / "crashed", (0.070, 0.073, 0.068, 0.88), name="c")
    write_robot(tmp_path / "once", tolerance=2e-4)
    write_visits(tmp_path / "once", (0.070, 0.6, 0.068, 0.071), name="o")
    for name, scale in (("a", 1.0), ("b", 1.3)):
        write_robot(tmp_path / name, tolerance=2e-4)
        write_visits(tmp_path / name, tuple(scale * e for e in (0.07, 0.077, 0.068, 0.075)), name=name)
    write_robot(tmp_path / "bare")
    document = review_fleet(tmp_path).document()
    crashed = robot_named(document, "crashed")
    assert not crashed["drifts"]
    assert crashed["outlook"] == f"P90 rose from 0.068 mm ({DAYS[2]}) to 0.880 mm ({DAYS[3]})"
    for name in ("a", "b", "once"):
        assert robot_named(document, name)["outlook"] == "no significant trend of the errors"
    assert robot_named(document, "bare")["outlook"] == "not judged"
    assert document["headline"].endswith("; drifting or changed: crashed")


def test_no_date_far_beyond_the_observed_time(tmp_path: Path) -> None:
    write_robot(tmp_path / "slow", tolerance=1e-3)
    write_visits(tmp_path / "slow", (0.100, 0.1196, 0.1405, 0.1597, 0.1802), name="g")
    slow = robot_named(review_fleet(tmp_path), "slow")
    assert slow["drifts"] and slow["reaches"] is None and "farther ahead" in slow["outlook"]


def test_calibration_begins_a_new_series(tmp_path: Path) -> None:
    """Errors that fall because the robot was calibrated again are no trend."""
    write_robot(tmp_path / "arm", tolerance=2e-4)
    for day, error, calibration in zip(DAYS, (0.2, 0.21, 0.1, 0.1, 0.1), "aabbb", strict=True):
        write_verification(tmp_path / "arm" / day, error, data=day, calibration=calibration)
    trend = robot_named(review_fleet(tmp_path), "arm")["trend"]
    assert trend["visits"] == 3 and trend["first"] == DAYS[2]


def test_repeated_results_are_no_further_visits(tmp_path: Path) -> None:
    """The same results in three dated folders, and three results of one day, are one visit each."""
    write_robot(tmp_path / "copied")
    for day in DAYS[:3]:
        write_verification(tmp_path / "copied" / day, 0.1, data="same")
    write_robot(tmp_path / "one_day")
    for k in range(4):
        write_verification(tmp_path / "one_day" / DAYS[0] / str(k), 0.1 + 0.01 * k, data=f"d{k}")
    fleet = review_fleet(tmp_path)
    assert all(robot["trend"] is None for robot in fleet.document()["robots"])
    assert any("2 results stand in several folders" in remark for remark in fleet.document()["remarks"])


def test_copied_project_is_no_second_robot(tmp_path: Path) -> None:
    for name in ("first", "second"):
        write_robot(tmp_path / name)
        write_calibration(tmp_path / name, {"j1.offset": (1e-3, 1e-4)}, data="a")
    (problem,) = review_fleet(tmp_path).document()["problems"]
    assert problem["place"] == "second/estimates.yaml" and "first" in problem["sentence"]


def test_parameters_of_the_setup_are_not_compared(tmp_path: Path) -> None:
    """Neither a station, nor the joint on the base, nor what absorbed the place of the point, nor what a prior holds."""
    rng = np.random.default_rng(3)
    for k in range(8):
        write_robot(tmp_path / f"r{k}")
        odd = 0.05 if k == 5 else 0.0
        values = {
            "j1.offset": (float(rng.normal(0, 1e-3)), 1e-4),
            "j2.offset": (float(rng.normal(0, 1e-3)) + odd, 1e-4),
            "j3.length_x": (float(rng.normal(0, 1e-3)), 1e-4),
            "j3.offset": (float(rng.normal(0, 1e-3)), 1e-4),
            "station.tracker.x": (float(rng.normal()), 1e-4),
            "point.ball.x": (0.0, 1e-4),
        }
        write_calibration(
            tmp_path / f"r{k}", values, data=f"{k}", dropped={"point.ball.x": {"j3.length_x": 0.7}}
        )
    document = review_fleet(tmp_path).document()
    assert {item["name"] for item in document["parameters"]} == {"j2.offset", "j3.offset"}
    (spread,) = [item for item in document["parameters"] if item["name"] == "j2.offset"]
    assert [item["robot"] for item in spread["outliers"]] == ["r5"]
    assert spread["spread"] < 3e-3
    for k in range(8):
        write_calibration(tmp_path / f"r{k}", {"j2.offset": (1e-6 * k, 1e-4)}, data=f"{k}", prior_std=2e-4)
    assert review_fleet(tmp_path).document()["parameters"] == []


def test_drift_of_a_parameter(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    for k in range(6):
        write_robot(tmp_path / f"r{k}")
        for visit, day in enumerate(DAYS):
            drift = 5e-4 * visit if k == 2 else 0.0
            values = {
                name: (float(rng.normal(0, 5e-5)), 5e-5) for name in ("j1.offset", "j2.offset", "j3.offset")
            }
            values["j2.offset"] = (values["j2.offset"][0] + drift, 5e-5)
            write_calibration(tmp_path / f"r{k}" / day, values, data=f"{k} {day}")
    document = review_fleet(tmp_path).document()
    (drift,) = document["parameter_drifts"]
    assert (drift["robot"], drift["name"]) == ("r2", "j2.offset")
    assert drift["low"] < 1e-3 < drift["high"]


def test_rechecks_are_corrected_for_their_number(tmp_path: Path) -> None:
    """Of twelve robots one with p = 0.8 % is as expected by chance, one with p = 0.01 % is not."""
    for k in range(12):
        write_robot(tmp_path / f"r{k}")
        probability = {3: 8e-3, 7: 1e-4}.get(k, 0.5)
        write_visits_of_recheck(
            tmp_path / f"r{k}" / "recheck", (("2026-01-02", 0.4), ("2026-02-02", probability)), limit=0.01
        )
    fleet = review_fleet(tmp_path)
    document = fleet.document()
    assert document["counts"] | {"rechecked": 12, "changed": 1, "problems": 0} == document["counts"]
    assert (
        robot_named(fleet, "r7")["recheck"] | {"changed": True, "date": "2026-02-02"}
        == robot_named(fleet, "r7")["recheck"]
    )
    changed = robot_named(fleet, "r7")["outlook"]
    assert changed == "not as calibrated by the recheck of 2026-02-02: joint shifted"
    assert robot_named(fleet, "r0")["outlook"] == "not judged; as calibrated by the recheck of 2026-02-02"
    assert document["headline"].endswith("; drifting or changed: r7") and document["counts"]["drifting"] == 1
    found = robot_named(fleet, "r3")["recheck"]
    assert found["verdict"] == "joint_shifted" and not found["changed"]
    frame = fleet.gathered.table.frame
    shift = frame.filter(robot="r7", name="shift.j2").sort("date").row(-1, named=True)
    assert (shift["value"], shift["std"]) == (2e-4, pytest.approx(5e-5))


def test_joints_on_the_base(tmp_path: Path) -> None:
    """A fixed joint under the first movable one, a locked one before it, and two arms on one base."""
    folder = tmp_path / "arm"
    write_robot(folder)
    joints = (
        ("mount", "fixed", "base", "a"),
        ("lift", "prismatic", "a", "b"),
        ("left", "revolute", "b", "c"),
    )
    joints += (("right", "revolute", "a", "d"), ("elbow", "revolute", "c", "e"))
    text = "".join(
        f'<joint name="{n}" type="{t}"><parent link="{p}"/><child link="{c}"/></joint>'
        for n, t, p, c in joints
    )
    (folder / "arm.urdf").write_text(f'<robot name="two">{text}</robot>', "utf-8")
    (folder / "robot.yaml").write_text("robot: arm.urdf\nlocked: {lift: 0.1}\n", "utf-8")
    (project,) = gather_fleet(tmp_path).projects
    assert project.base == {"left", "right"}


def test_problems_are_rows(tmp_path: Path) -> None:
    write_robot(tmp_path / "good", tolerance=2e-4)
    write_verification(tmp_path / "good" / "out", 0.1, data="g")
    write_robot(tmp_path / "yaml")
    (tmp_path / "yaml" / "robot.yaml").write_text("robot: arm.urdf\nspeed: 3\n", "utf-8")
    write_robot(tmp_path / "json")
    (tmp_path / "json" / "results.json").write_text('{"kind": "verif', "utf-8")
    write_robot(tmp_path / "keys")
    (tmp_path / "keys" / "results.json").write_text('{"kind": "verification", "schema": 1}', "utf-8")
    write_robot(tmp_path / "no_urdf")
    (tmp_path / "no_urdf" / "arm.urdf").unlink()
    write_verification(tmp_path / "stray", 0.1, data="s")
    write_robot(tmp_path / "future")
    write_verification(tmp_path / "future" / "2925-01-01", 0.1, data="t")
    write_robot(tmp_path / "npz")
    write_calibration(tmp_path / "npz", {"j1.offset": (1e-3, 1e-4)}, data="a")
    (tmp_path / "npz" / "estimates.npz").write_bytes(b"PK no zip")
    fleet = review_fleet(tmp_path)
    problems = {item["place"].partition("/")[0]: item["sentence"] for item in fleet.document()["problems"]}
    assert set(problems) == {"yaml", "json", "keys", "no_urdf", "stray", "future", "npz"}
    assert robot_named(fleet, "good")["state"] == "within"
    assert all(sentence.endswith(".") and str(tmp_path) not in sentence for sentence in problems.values())


def test_serial_joins_folders(tmp_path: Path) -> None:
    for site in ("a", "b"):
        write_robot(tmp_path / site, serial="X1")
        write_verification(tmp_path / site / "2025-01-01", 0.1, data=site)
    (robot,) = review_fleet(tmp_path).document()["robots"]
    assert (robot["robot"], robot["results"]) == ("X1", 2)


def test_dated_projects_are_one_robot(tmp_path: Path) -> None:
    for day in DAYS[:2]:
        write_robot(tmp_path / "arm" / day)
        write_verification(tmp_path / "arm" / day, 0.1, data=day)
    (robot,) = review_fleet(tmp_path).document()["robots"]
    assert (robot["robot"], robot["verified"]) == ("arm", DAYS[1])


@pytest.mark.parametrize("protocol", ["file", "memory"])
def test_bucket(tmp_path: Path, protocol: str) -> None:
    fsspec = pytest.importorskip("fsspec")
    write_robot(tmp_path / "fleet" / "arm", tolerance=2e-4)
    write_verification(tmp_path / "fleet" / "arm" / "2025-01-01", 0.1, data="a")
    address = (tmp_path / "fleet").as_uri()
    if protocol == "memory":
        address = f"memory://{tmp_path.name}/fleet"
        fsspec.filesystem("memory").put(f"{tmp_path / 'fleet'}/", f"/{tmp_path.name}/fleet/", recursive=True)
    there, here = (
        review_fleet(place).gathered.table.frame.drop("modified") for place in (address, tmp_path / "fleet")
    )
    assert there.equals(here)


def test_refusals(tmp_path: Path) -> None:
    with refused("E-FLEET-001", "nowhere"):
        review_fleet(tmp_path / "nowhere")
    with refused("E-FLEET-004"):
        review_fleet(f"memory://{tmp_path.name}/empty")
    with refused("E-FLEET-003", "nosuch"):
        review_fleet("nosuch://bucket")
    with refused("E-FLEET-005", "robot.yaml"):
        review_fleet(tmp_path)


def test_a_calibration_that_its_points_refute_hides_nothing(tmp_path: Path) -> None:
    """A robot once calibrated on points in feet is named, and its parameters count nowhere; another's drift is found beside it."""
    rng = np.random.default_rng(7)
    for number in range(4):
        folder = tmp_path / f"arm_{number}"
        write_robot(folder)
        for visit, day in enumerate(DAYS):
            steps = [1e-6 * rng.standard_normal(), 1e-6 * rng.standard_normal()]
            if number == 0:
                steps[1] += 4e-5 * visit
            feet = number == 1 and visit == 4
            if feet:
                steps = [0.4, 1.4]
            write_calibration(
                folder / day,
                {"j1.offset": (1e-3 + steps[0], 2e-6), "j2.length_x": (2e-3 + steps[1], 2e-6)},
                data=f"{number} {day}",
            )
            document = {"kind": "calibration", "schema": 1, "fit": {"is_implausible": feet}, "lag": None}
            (folder / day / "results.json").write_text(json.dumps(document), "utf-8")
    gathered = gather_fleet(tmp_path)
    (problem,) = [item for item in gathered.problems if "estimates.yaml" in item.place]
    assert problem.place == f"arm_1/{DAYS[4]}/estimates.yaml"
    values = gathered.table.frame.filter(pl.col("kind") == "calibration")["value"]
    assert len(values) == 2 * 19 and values.abs().max() < 0.1
    assert robot_named(review_fleet(tmp_path), "arm_0")["drifting_parameters"] == ["j2.length_x"]


@pytest.mark.parametrize(
    ("name", "date"),
    [
        ("2026-03-01T14-30_after", datetime(2026, 3, 1, 14, 30)),
        ("visit_2026_03_01", datetime(2026, 3, 1)),
        ("2026.03.01", datetime(2026, 3, 1)),
        ("01.03.2026", datetime(2026, 3, 1)),
        ("20260301", None),
        ("2026-13-01", None),
        ("2026-03_01", None),
        ("serial_12345.01.2026", None),
    ],
)
def test_dates_in_names_of_folders(name: str, date: datetime | None) -> None:
    assert date_of(("hall", name)) == date
