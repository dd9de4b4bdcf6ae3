"""`flexcal map`, `repeatability` and `certificate` on the UR5's calibration, through files, and on files that do not fit."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import copied, read_csv, snapshot, write_csv
from refusals import assert_refusal

from flexcal.calibration.measurement import predict_measurements
from flexcal.cli.main import main
from flexcal.data.poses import read_poses, write_poses
from flexcal.files.formats import sha256_of
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.report.layout import millimetres

Q = [f"q{i}" for i in range(1, 7)]
SIGMA = 2e-5


@pytest.fixture(scope="module")
def calibrated(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR5 with rigid geometry fitted to 150 poses of its grid, targets.csv of its random poses, the commands for them, and what a tracker
    with noise sees three times at these commands when the calibrated robot is the real one."""
    folder = copied(examples / "ur5_tracker", tmp_path_factory.mktemp("accuracy") / "ur5")
    robot = folder / "robot.yaml"
    header, rows = read_csv(folder / "grid.csv")
    some = write_csv(folder / "some.csv", header, rows[::7][:140])
    assert main(["calibrate", str(robot), str(some), "--terms", "kinematic"]) == 0
    header, rows = read_csv(folder / "random.csv")
    targets = write_csv(folder / "targets.csv", header[:7], rows[:, :7])
    assert main(["compensate", str(robot), str(targets), "--out", str(folder / "commands.csv")]) == 0
    model = RobotModel.from_yaml(robot)
    nominal = read_poses(folder / "random.csv", model)
    commands = pl.read_csv(folder / "commands.csv")
    rng = np.random.default_rng(3)
    parameter_rows = np.tile(np.arange(20), 3)
    again = nominal.subset(parameter_rows)
    q = commands.select(Q).to_numpy()[parameter_rows]
    after = replace(again, q=q, sigma=np.full((60, 3), SIGMA), sigma_given=True)
    seen = predict_measurements(model, after).position + SIGMA * rng.standard_normal((60, 3))
    write_poses(folder / "after.csv", replace(after, position=seen))
    return folder


@pytest.fixture
def ur5(calibrated: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(calibrated, tmp_path / "ur5"))


def test_map_of_a_box_and_its_table(run, ur5: Path) -> None:
    out = ur5 / "map.csv"
    arguments = ["--working", "0.2:0.6,-0.4:0.4,0.1:0.6", "--count", "600", "--out", out]
    done = run("map", ur5 / "robot.yaml", *arguments, "--verification", ur5 / "random.csv", "--json")
    assert done.status == 0 and "next: flexcal compensate" in done.err
    document, table = done.document, pl.read_csv(out)
    assert table.columns == ["x", "y", "z", *Q, "mean_mm", "p95_mm", "uncalibrated_mm"] and len(table) == 600
    model = RobotModel.from_yaml(ur5 / "robot.yaml")
    at = point_kinematics(model, table.select(Q).to_numpy(), jacobians=False).position
    np.testing.assert_allclose(table.select("x", "y", "z").to_numpy(), at, atol=1e-12)
    p95 = table["p95_mm"].to_numpy()
    assert document["predicted"]["p95"]["worst_mm"] == pytest.approx(p95.max())
    assert document["predicted"]["p95"]["median_mm"] == pytest.approx(np.median(p95))
    assert [item["p95_mm"] for item in document["worst"]] == sorted(
        (item["p95_mm"] for item in document["worst"]), reverse=True
    )
    assert set(document["sources"]) == {"geometry", "instrument's place", "repeatability", "model error"}
    check = document["verification"]
    # the files state no sigma: what instrument, robot and model error scatter was found from the points of the calibration
    assert document["verdict"]["trusted"] is True and "claimed_uncertainty" in document["verdict"]["reasons"]
    assert (
        check["verdict"] == "right" and check["ratio_low"] < 1 < check["ratio_high"] and check["applied"] == 1
    )
    assert not any("no sigma" in remark for remark in document["remarks"])
    page = (ur5 / "map.html").read_text(encoding="utf-8")
    assert "accuracy map" in page and "figure-predicted" in page and "predictions are not reduced" in page
    seen = run("map", ur5 / "robot.yaml", *arguments, "--verification", ur5 / "some.csv", "--json")
    assert seen.document["verification"]["fitted"] == ["some.csv"]
    assert seen.document["verdict"]["trusted"] is None
    assert "it was fitted to some.csv" in (ur5 / "map.html").read_text(encoding="utf-8")
    bare = run("map", ur5 / "robot.yaml", *arguments, "--json").document
    ratio = document["predicted"]["p95"]["worst_mm"] / bare["predicted"]["p95"]["worst_mm"]
    assert ratio == pytest.approx(check["applied"], rel=1e-9) and bare["verification"] is None
    assert run("map", ur5 / "robot.yaml", *arguments).status == 0


def test_map_of_given_poses(run, ur5: Path) -> None:
    done = run(
        "map", ur5 / "robot.yaml", "--working", ur5 / "targets.csv", "--out", ur5 / "here.html", "--json"
    )
    assert done.status == 0 and done.document["poses"] == 20 and done.document["box_m"] is None
    assert "no verification" in done.err and not (ur5 / "here.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "refusal"),
    [
        (["--out", "map.txt"], ["E-RUN-009", "map.txt"]),
        (["--working", "5:6,5:6,5:6"], ["E-CAL-004", "5, 5, 5", "6, 6, 6"]),
        (["--working", "0.6:0.2,-1:1,0:1"], ["E-CAL-003"]),
        (["--working", "0:1,a:b,0:1"], ["E-RUN-037"]),
        (["--working", "nowhere.csv"], ["E-FILE-001", "nowhere.csv"]),
        (["--count", "0"], ["E-CLI-008", "--count", "0", "1"]),
        (["--on", "nowhere"], ["E-WORK-006", "nowhere"]),
        (["--payload", "2"], ["E-MODEL-004", "robot.yaml"]),
        (["--verification", "targets.csv"], ["E-POSES-020"]),
        (["--estimates", "elsewhere"], ["E-RUN-055", "elsewhere does not exist"]),
    ],
)
def test_what_no_map_can_be_made_of(
    run, ur5: Path, monkeypatch: pytest.MonkeyPatch, arguments: list, refusal: list[str]
) -> None:
    monkeypatch.chdir(ur5)
    before = snapshot(ur5)
    done = run("map", "robot.yaml", *arguments)
    assert done.status == 2 and done.err.strip().count("\nflexcal:") <= 1
    assert_refusal(done.err, *refusal)
    assert "Traceback" not in done.err and snapshot(ur5) == before


def test_the_file_is_named_that_cannot_verify_a_map(run, ur5: Path) -> None:
    one = ur5 / "one.csv"
    one.write_text("".join((ur5 / "random.csv").read_text().splitlines(keepends=True)[:2]))
    done = run("map", ur5 / "robot.yaml", "--verification", one, "--out", ur5 / "not.html")
    assert done.status == 2 and not (ur5 / "not.html").exists()
    assert_refusal(done.err, "E-CAL-017", str(one), "1 of the 1")


def test_repeatability_of_measured_visits(run, ur5: Path) -> None:
    done = run("repeatability", ur5 / "robot.yaml", ur5 / "after.csv", "--out", ur5 / "visits", "--json")
    assert done.status == 0
    document, poses = done.document, pl.read_csv(ur5 / "after.csv")
    assert document["poses"] == 20 and document["visits"] == {"fewest": 3, "total": 60}
    points = poses.filter(pl.col("pose") == 4).select("x", "y", "z").to_numpy()
    distance = np.sqrt(((points - points.sum(axis=0) / 3) ** 2).sum(axis=1))
    rp = distance.mean() + 3 * np.sqrt(((distance - distance.mean()) ** 2).sum() / 2)
    assert next(p for p in document["each"] if p["pose"] == 4)["rp_mm"] == pytest.approx(1e3 * rp)
    # three visits with 0.02 mm of noise an axis centre within some 0.02 mm of where the model has the point
    assert 0.01 < document["ap_calibrated_mm"]["mean"] < 0.03 < 0.3 < document["ap_nominal_mm"]["mean"]
    assert "ISO 9283 asks for 30 visits to each pose; there are 3" in done.err
    assert "RP" in (ur5 / "visits" / "report.html").read_text(encoding="utf-8")
    once = run("repeatability", ur5 / "robot.yaml", ur5 / "random.csv")
    assert once.status == 2
    assert_refusal(once.err, "E-CAL-002", "20")


def test_drift_of_a_robot_that_warms_up(run, ur5: Path) -> None:
    """Forty cycles through five poses, a minute each pose: all go 0.2 mm along x together, pose 2 another 0.1 mm along z."""
    first = pl.read_csv(ur5 / "after.csv").unique("pose", maintain_order=True).head(5)
    rng = np.random.default_rng(8)
    cycles = []
    for k in range(40):
        warm = k / 39
        noise = SIGMA * rng.standard_normal((5, 3))
        alone = pl.when(pl.col("pose") == first["pose"][1]).then(1e-4 * warm).otherwise(0.0)
        cycles.append(
            first.with_columns(
                pl.col("x") + 2e-4 * warm + pl.Series(noise[:, 0]),
                pl.col("y") + pl.Series(noise[:, 1]),
                pl.col("z") + alone + pl.Series(noise[:, 2]),
                t=pl.Series(60.0 * (5 * k + np.arange(5))),
            )
        )
    table = pl.concat(cycles)
    table.write_csv(ur5 / "cycles.csv")
    done = run("repeatability", ur5 / "robot.yaml", ur5 / "cycles.csv", "--out", ur5 / "drift", "--json")
    assert done.status == 0 and not any("times in the files" in text for text in done.document["remarks"])
    drift, each = done.document["drift"], done.document["drift"]["each"]
    points = table.filter(pl.col("pose") == first["pose"][1]).select("x", "y", "z").to_numpy()
    centres = points.reshape(4, 10, 3).mean(axis=1)
    np.testing.assert_allclose(
        each[1]["way_mm"], 1e3 * np.linalg.norm(centres - centres[0], axis=1), rtol=1e-9
    )
    np.testing.assert_allclose(each[1]["t_s"], 60.0 * (np.array([22.5, 72.5, 122.5, 172.5]) + 1))
    assert all(item["certain"] and len(item["rp_mm"]) == 4 for item in each)
    # from the middle of the first ten cycles to that of the last it is 30/39 of the whole way
    assert drift["together_mm"] == pytest.approx(0.2 * 30 / 39, abs=0.02)
    assert drift["way_mm"]["max"] == pytest.approx(np.hypot(0.2, 0.1) * 30 / 39, abs=0.03)
    course = each[1]["ap_calibrated_mm"]
    assert each[1]["dap_calibrated_mm"] == pytest.approx(abs(course[-1] - course[0]), rel=1e-12)
    page = (ur5 / "drift" / "report.html").read_text(encoding="utf-8")
    assert "figure-drift" in page and "Drift: the displacement common to all poses is" in page
    shown = run("repeatability", ur5 / "robot.yaml", ur5 / "cycles.csv").out
    assert (
        "drift of repeatability, dRP" in shown
        and "from the first set of visits to the last: at 5 of 5 poses" in shown
    )


def test_times_that_do_not_go_on(run, ur5: Path) -> None:
    """Two files that both begin at zero."""
    table = pl.read_csv(ur5 / "after.csv")
    timed = [table.with_columns(t=np.arange(60.0)), table.with_columns(t=np.arange(60.0) + 0.5)]
    pl.concat(timed).write_csv(ur5 / "both.csv")
    done = run("repeatability", ur5 / "robot.yaml", ur5 / "both.csv", "--json")
    assert done.document["drift"] is None
    assert any("increase from row to row and file to file" in text for text in done.document["remarks"])


def test_repeatability_needs_no_calibration(run, ur5_folder: Path, calibrated: Path) -> None:
    done = run("repeatability", ur5_folder / "robot.yaml", calibrated / "after.csv", "--json")
    assert done.status == 0 and "ap_calibrated_mm" not in done.document
    assert any("there is no calibration" in remark for remark in done.document["remarks"])


def certify(run, ur5: Path, *more: object):
    given = ["--targets", ur5 / "targets.csv", "--before", ur5 / "random.csv", "--after", ur5 / "after.csv"]
    return run("certificate", ur5 / "robot.yaml", *given, "--out", ur5 / "certificate.html", *more)


def test_certificate(run, ur5: Path) -> None:
    done = certify(run, ur5, "--json")
    assert done.status == 0
    document = done.document
    before, after = document["before"]["ap"], document["after"]["ap"]
    # 0.61 mm is what the README says of the registered UR5 before, and what is left is the noise of three visits
    registered = document["before"]["registered"]
    assert registered["mean_mm"] == pytest.approx(0.61, abs=0.01) and document["before"]["rp"] is None
    assert document["before"]["own"] == before and before["mean_mm"] < registered["mean_mm"]
    assert (
        document["before"]["declared"] is None
    )  # the tracker's frame is the URDF's base turned by 180 degrees
    assert 0.01 < after["mean_mm"] < 0.03 and document["after"]["rp"]["visits"] == 3
    assert document["after_refitted"]["ap"]["mean_mm"] < 1.1 * after["mean_mm"]
    assert document["rms_mm"]["visit_to_visit"] == pytest.approx(1e3 * SIGMA * np.sqrt(3), rel=0.2)
    assert document["prediction"]["verdict"] in ("right", "cautious")
    page = (ur5 / "certificate.html").read_text(encoding="utf-8")
    for file in ("targets.csv", "random.csv", "after.csv", "robot.yaml"):
        assert sha256_of(ur5 / file) in page and file in page
    assert "@page { size: A4" in page and "<script" not in page and "http" not in page
    assert (
        len(re.findall("<circle", page)) == 40 and f"<b>{millimetres(1e-3 * before['p90_mm'])} mm</b>" in page
    )


def test_a_certificate_is_for_the_temperature_that_was_given(run, ur5: Path) -> None:
    done = certify(run, ur5, "--temperature", "40", "--json")
    assert done.status == 0 and done.document["temperature"] == [40.0, 40.0]
    assert any("the temperature is not used" in remark for remark in done.document["remarks"])


def test_a_certificate_has_the_particulars_that_were_given(run, ur5: Path) -> None:
    """What is not given stays a line to fill in, as on the customer's sheets."""
    given = ("--instrument", "tracker T", "--robot-serial", "R-17", "--operator", "A. Meier")
    assert certify(run, ur5, *given).status == 0
    page = (ur5 / "certificate.html").read_text(encoding="utf-8")
    assert all(f"<td>{text}</td>" in page for text in ("tracker T", "R-17", "A. Meier"))
    assert page.count('class="blank"') == 2


def test_targets_without_a_command_are_not_compared(run, ur5: Path) -> None:
    table = pl.read_csv(ur5 / "after.csv").filter(pl.col("pose") > 2)
    table.write_csv(ur5 / "after.csv")
    done = certify(run, ur5, "--json")
    assert done.document["targets"] == 17 and "are not compared: 3" in done.err
    assert done.document["before"]["measurements"] == 17


@pytest.mark.parametrize(
    ("change", "refusal"),
    [
        (pl.col("pose") + 100, ["E-RUN-005", "after.csv", "100"]),
        (((pl.col("pose") + 1) % 20), ["E-RUN-007"]),
        (pl.lit("nose").alias("target"), ["E-POSES-010", "nose"]),
        (pl.lit("roof").alias("station"), ["E-RUN-008", "roof"]),
    ],
)
def test_measurements_of_other_targets(run, ur5: Path, change: pl.Expr, refusal: list[str]) -> None:
    pl.read_csv(ur5 / "after.csv").with_columns(change).write_csv(ur5 / "after.csv")
    before = snapshot(ur5)
    done = certify(run, ur5)
    sentences = [line for line in done.err.splitlines() if not line.endswith(" …")]
    assert done.status == 2 and len(sentences) == 1
    assert_refusal(sentences[0], *refusal)
    assert snapshot(ur5) == before


def test_certificate_needs_two_measurements_of_four_targets(run, ur5: Path) -> None:
    given = ["--targets", ur5 / "targets.csv", "--before", ur5 / "random.csv", "--after", ur5 / "random.csv"]
    same = run("certificate", ur5 / "robot.yaml", *given)
    assert same.status == 2
    assert_refusal(same.err, "E-RUN-002")
    pl.read_csv(ur5 / "after.csv").filter(pl.col("pose") < 3).write_csv(ur5 / "after.csv")
    few = certify(run, ur5)
    assert few.status == 2
    assert_refusal(few.err, "E-RUN-004", "3")
    swapped = run(
        "certificate", ur5 / "robot.yaml", *given[:3], ur5 / "after.csv", "--after", ur5 / "random.csv"
    )
    assert swapped.status == 2
    assert_refusal(swapped.err, "E-RUN-003")
    odd = run("certificate", ur5 / "robot.yaml", *given[:-1], ur5 / "after.csv", "--out", ur5 / "page.pdf")
    assert odd.status == 2
    assert_refusal(odd.err, "E-RUN-001", "page.pdf")


def test_a_certificate_without_sigma_and_visits_is_judged_by_the_scatter_of_the_calibration(
    run, ur5: Path
) -> None:
    once = pl.read_csv(ur5 / "after.csv").unique("pose", maintain_order=True)
    wander = pl.Series(5e-4 * np.random.default_rng(3).standard_normal(len(once)))
    once.with_columns(pl.col("x") + wander).drop("^sigma.*$").write_csv(ur5 / "after.csv")
    done = certify(run, ur5, "--json")
    assert done.document["prediction"]["verdict"] == "optimistic"
    assert "flexcal import --sigma" not in " ".join(done.document["remarks"])
    assert "too small" in (ur5 / "certificate.html").read_text(encoding="utf-8")
