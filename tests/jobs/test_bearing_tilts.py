"""Springs of bearings and drives from logs with the tilts, on a robot simulated in MuJoCo with a hinge for every tilt."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from over_seeds import over_seeds
from refusals import refused
from tilting_robot import (
    BEARING,
    BEARING_DAMPING,
    CAD_LINKS,
    DRIVE,
    ROBOT,
    TRUE_LINKS,
    drawn_links,
    urdf,
    write_tilting,
)

from flexcal.cli.main import main
from flexcal.dynamics.estimators import EstimatorName
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.model.robot import RobotModel

STIFFNESS = {f"{name}.stiffness": value for name, value in BEARING.items()}
STIFFNESS |= {f"{joint}.drive.stiffness": value for joint, value in DRIVE.items()}


def robot_of(folder: Path, *, before: bool = False, links=CAD_LINKS) -> Path:
    (folder / "tilting.urdf").write_text(urdf(*links))
    path = folder / "robot.yaml"
    path.write_text(ROBOT.format(bearings="before" if before else "after"))
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tilting(tmp_path_factory.mktemp("tilts") / "log.parquet", 3, noise=0.002, tilt_noise=1e-6)


@pytest.mark.parametrize("before", [False, True])
def test_bearings_and_drives_are_found(before: bool, tmp_path: Path) -> None:
    """Wherever the bearings tilt; gravity and inertia of the tilts are CAD's, whose error is 3e-4 of the stiffness."""
    own = write_tilting(tmp_path / "log.parquet", 5, before=before, noise=0.002, tilt_noise=1e-6)
    found = identify_robot_dynamics(robot_of(tmp_path, before=before), [own], flexible=True)
    document = found.document()
    truth = STIFFNESS | {f"{name}.damping": BEARING_DAMPING for name in BEARING}
    for name, value in truth.items():
        item = document["parameters"][name]
        assert abs(item["estimate"] - value) < 4 * item["std"] + 5e-4 * value, name
        assert item["std"] < (0.1 if name.endswith("damping") else 0.002) * value, name
    assert max(document["error_percent"]["per_bearing"].values()) < 1.0
    pickle.dumps(found.train.observation)


def test_without_noise_nothing_is_left_but_what_cad_has_wrong(tmp_path: Path) -> None:
    """With the true links filters, differences and reversals leave 1e-5; with CAD's the errors are those that the intervals admit."""
    log = write_tilting(tmp_path / "log.parquet", 114)
    exact, off = (
        identify_robot_dynamics(robot_of(tmp_path, links=links), [log], flexible=True).estimate
        for links in (TRUE_LINKS, CAD_LINKS)
    )
    for name, value in STIFFNESS.items():
        assert exact.values[name] == pytest.approx(value, rel=1e-5), name
        std = off.std(name)
        assert std is not None and abs(off.values[name] - value) < 3 * std + 1e-5 * value, name
    assert abs(off.values["turn.bearing_y.stiffness"] / STIFFNESS["turn.bearing_y.stiffness"] - 1) > 1e-4


def test_without_the_tilts_the_arm_fits_worse(log: Path, tmp_path: Path) -> None:
    robot, rigid = robot_of(tmp_path), tmp_path / "rigid.parquet"
    pl.read_parquet(log).drop("qax1", "qax2", "qay1", "qay2").write_parquet(rigid)
    with_tilts, without = (
        identify_robot_dynamics(robot, [own], flexible=True).document()["error_percent"]["per_joint"]["turn"]
        for own in (log, rigid)
    )
    assert with_tilts < 0.5 * without


@pytest.mark.parametrize("estimator", ["ols", "irls", "sdp"])
def test_estimators_of_the_flexible_model(estimator: EstimatorName, log: Path, tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    found = identify_robot_dynamics(robot, [log], flexible=True, estimator=estimator).estimate
    if estimator == "sdp":
        assert (
            RobotModel.from_yaml(robot).value("turn.bearing_x.stiffness")
            == found.values["turn.bearing_x.stiffness"]
        )
    for name, value in BEARING.items():
        assert found.values[f"{name}.stiffness"] == pytest.approx(value, rel=0.02)


def test_the_command_shows_the_bearings(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(robot_of(tmp_path)), str(log), "--flexible", "--out", str(tmp_path / "out")]
    assert main(["identify", "dynamics", *arguments]) == 0
    assert "turn.bearing_y.stiffness" in capsys.readouterr().out
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.parametrize(
    ("change", "refusal"),
    [
        (lambda table: table.drop("qay1", "qay2"), ["E-RUN-028", "qay1…qay2"]),
        (
            lambda table: table.with_columns(pl.col("qax1") * 1e3),
            ["E-RUN-029"],
        ),
    ],
)
def test_tilts_that_cannot_be(change, refusal: list[str], log: Path, tmp_path: Path) -> None:
    own = tmp_path / "log.parquet"
    change(pl.read_parquet(log)).write_parquet(own)
    with refused(*refusal):
        identify_robot_dynamics(robot_of(tmp_path), [own], flexible=True)


def test_tilts_of_no_bearings(log: Path, tmp_path: Path) -> None:
    robot = robot_of(tmp_path)
    lines = robot.read_text().splitlines()
    start = lines.index("elastic:")
    robot.write_text("\n".join([*lines[: start + 1], "  - {joint: turn, drive: {stiffness: 5000}}"]))
    with refused("E-RUN-030"):
        identify_robot_dynamics(robot, [log], flexible=True)


def held(seed: int, root: Path) -> np.ndarray:
    """Which intervals (4, p) of a robot's four logs hold the truth."""
    truth = STIFFNESS | {f"{name}.damping": BEARING_DAMPING for name in BEARING}
    folder = root / str(seed)
    folder.mkdir()
    clean = write_tilting(folder / "clean.parquet", seed, before=bool(seed % 2))
    inside = []
    for k in range(4):
        rng = np.random.default_rng([seed, k])
        noisy = pl.read_parquet(clean).with_columns(
            [pl.col(f"tau{i}") + 0.002 * pl.col(f"tau{i}").std() * rng.normal(size=15000) for i in (1, 2)]
            + [pl.col(name) + 2e-6 * rng.normal(size=15000) for name in ("qax1", "qay1", "qax2", "qay2")]
        )
        noisy.write_parquet(folder / "log.parquet")
        robot = robot_of(folder, before=bool(seed % 2), links=drawn_links(rng))
        found = identify_robot_dynamics(robot, [folder / "log.parquet"], flexible=True).estimate
        ends = np.array([found.interval(name) or (np.nan, np.nan) for name in truth])
        inside.append((ends[:, 0] <= list(truth.values())) & (list(truth.values()) <= ends[:, 1]))
    return np.array(inside)


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """Sixteen robots, each with four logs and CAD errors of its own."""
    inside = np.concatenate(over_seeds(held, range(300, 316), tmp_path))
    print(f"{100 * inside.mean():.1f} % of {inside.size} intervals")
    assert 0.93 <= inside.mean() <= 0.97, inside.mean(axis=0)
