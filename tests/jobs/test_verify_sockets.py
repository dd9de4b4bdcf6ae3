"""`verify` of a ball in sockets, on contacts of an arm of the test's own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_poses
from refusals import assert_refusal
from socket_arm import contacts, write_contacts, write_socket_robot

from flexcal import FlexcalError, RobotModel, calibrate, read_poses, verify
from flexcal.cli.main import main
from flexcal.jobs.accuracy import Verification
from flexcal.jobs.calibration import Calibration
from flexcal.jobs.calibration.held_out import held_out_group

SCATTER = 3e-5
SIZES = {0: (6, 10), 1: (8, 6), 2: (4, 14)}
"""Places of the fixture, and postures with the ball in each of its two sockets, by seed."""


@dataclass
class Cell:
    """A calibrated arm, and its true one."""

    folder: Path
    arm: DHArm
    model: RobotModel
    calibration: Calibration
    rng: np.random.Generator

    def verified(self, arm: DHArm, places: int, each: int, distance: float = 0.12) -> Verification:
        rows = contacts(
            arm, self.rng, places=places, postures_each=each, scatter=SCATTER, distance=distance, prefix="new"
        )
        file = write_contacts(self.folder / "new.csv", rows)
        return verify(self.calibration.robot, read_poses(file, self.model))


@pytest.fixture(scope="module")
def cells(tmp_path_factory: pytest.TempPathFactory) -> list[Cell]:
    found = []
    for seed, (places, each) in SIZES.items():
        folder, rng = tmp_path_factory.mktemp("cell"), np.random.default_rng([47, seed])
        arm = DHArm.made(seed)
        model = RobotModel.from_yaml(write_socket_robot(folder))
        rows = contacts(arm, rng, places=places, postures_each=each, scatter=SCATTER)
        poses = read_poses(write_contacts(folder / "fit.csv", rows), model)
        calibration = calibrate(model, poses, terms=["kinematic"])
        found.append(Cell(folder, arm, model, calibration, rng))
    return found


def test_fresh_contacts_are_met_as_predicted(cells: list[Cell]) -> None:
    """Yes for nearly each arm and size; all errors together are as large as predicted, of sockets and of their distances."""
    ratios, distances, trusted = [], [], 0
    for cell in cells:
        for places, each in ((3, 10), (8, 2), (2, 24)):
            found = cell.verified(cell.arm, places, each)
            prediction = found.document()["prediction"]
            assert found.trust.status in ("good", "care"), found.trust.sentence
            trusted += found.trust.status == "good"
            assert found.before.own is not None and "sockets" in found.summary()
            assert found.errors.mean < 0.6 * np.linalg.norm(found.before.own, axis=1).mean()
            expected = SCATTER * np.sqrt(3 * (1 - 1 / each))
            assert found.document()["rms_mm"]["measured"] == pytest.approx(1e3 * expected, rel=0.35)
            assert prediction["freedom"] < 3 * (2 * places * (each - 1)) * 1.02
            ratios.append(prediction["ratio"])
            distances += [item.error / (item.std or 0) for item in found.distances]
    assert trusted >= 7, "of 9, each with a chance of 5 % or less to be called larger"
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1, abs=0.1)
    assert 0.5 < np.sqrt(np.mean(np.square(distances))) < 1.4
    assert np.abs(distances).max() < 3.8


def test_a_joint_that_moved_by_a_milliradian_is_no_yes(cells: list[Cell]) -> None:
    """The fifth turns the ball about axes that postures turn: no. The first moves the robot as one, which no socket sees: yes."""
    for cell in cells:
        moved = cell.verified(cell.arm.turned(5, 1e-3), 3, 10)
        assert moved.trust.status == "bad" and "claimed_uncertainty" in moved.trust.reasons
        assert cell.verified(cell.arm.turned(3, 1e-3), 3, 10).trust.status in ("care", "bad")
    assert (
        cells[0].verified(cells[0].arm.turned(1, 1e-3), 3, 10).document()["prediction"]["verdict"] == "right"
    )


def test_scores_are_those_of_places_left_out(cells: list[Cell]) -> None:
    """A calibration without a place, verified with it, has the errors that `hold_out` gives that place."""
    cell = cells[2]
    poses = read_poses(cell.folder / "fit.csv", cell.model)
    own = poses.station == "place2"
    rest = calibrate(cell.model, poses.subset(~own), terms=["kinematic"])
    found, group = (
        verify(rest.robot, poses.subset(own)),
        held_out_group(rest.model, poses.subset(own), {"place0", "place1", "place3"}),
    )
    assert found.errors.mean == pytest.approx(group.errors.mean, rel=1e-3)
    (distance,) = found.distances
    assert group.distance is not None
    assert abs(distance.error) == pytest.approx(group.distance, abs=2e-5), "but for the scale of the fixture"


def test_the_uncalibrated_robot_has_its_ball_found(cells: list[Cell]) -> None:
    """Deviations of the nominal rows from the mean of each socket, the tool by linear least squares on finite differences."""
    cell = cells[1]
    found = cell.verified(cell.arm, 3, 6)
    q, step = found.poses.q, 1e-4
    socket = np.repeat(np.arange(len(q) // 6), 6)
    nominal = DHArm()

    def deviations(arm: DHArm) -> np.ndarray:
        ball = arm.points(q)
        return ball - np.array([ball[socket == k].mean(axis=0) for k in socket])

    declared = deviations(nominal)
    columns = [
        (deviations(nominal.bumped(tuple(axis))) - declared).ravel() / step for axis in step * np.eye(3)
    ]
    table = np.stack(columns, axis=1)
    shift = np.linalg.lstsq(table, -declared.ravel(), rcond=None)[0]
    own = declared + (table @ shift).reshape(-1, 3)
    assert found.before.registered is not None and found.before.own is not None
    np.testing.assert_allclose(found.before.registered, -declared, atol=1e-9)
    np.testing.assert_allclose(found.before.own, -own, atol=1e-8)


def test_another_distance_of_the_sockets_is_told(cells: list[Cell]) -> None:
    found = cells[0].verified(cells[0].arm, 4, 8, distance=0.1204)
    assert found.trust.status == "care" and "distances" in found.trust.reasons
    assert np.mean([item.error for item in found.distances]) == pytest.approx(4e-4, abs=6e-5)


def test_contacts_beside_a_calibration_by_a_tracker_cannot_be_judged(tmp_path: Path) -> None:
    """Its scatter is not that of a ball in a socket, whose size nobody stated; a joint that moved a lot is seen all the same."""
    rng, arm = np.random.default_rng(6), DHArm.made(6)
    model = RobotModel.from_yaml(write_socket_robot(tmp_path))
    q = postures(rng, 50)
    file = write_poses(tmp_path / "points.csv", q, tracked(arm.points(q), rng, 1e-5), 1e-5)
    calibration = calibrate(model, read_poses(file, model), terms=["kinematic"])
    rows = contacts(arm, rng, places=3, postures_each=8, scatter=SCATTER)
    found = verify(calibration.robot, read_poses(write_contacts(tmp_path / "new.csv", rows), model))
    assert found.trust.status == "unknown" and found.errors.mean < 6e-5
    assert all(item.std is None for item in found.distances)


@pytest.mark.parametrize(
    ("change", "refusal"),
    [
        ("once", ["E-CAL-040", "new0 a", "2 postures"]),
        ("refit", ["E-RUN-113", "--refit"]),
        ("mixed", ["E-CAL-039", "apart"]),
        ("map", ["E-RUN-102", "flexcal verify"]),
    ],
)
def test_what_verifies_nothing_is_refused(
    cells: list[Cell], tmp_path: Path, capsys: pytest.CaptureFixture, change: str, refusal: list[str]
) -> None:
    cell, rng = cells[2], np.random.default_rng(1)
    rows = contacts(cell.arm, rng, places=2, postures_each=2, prefix="new")
    if change == "once":
        del rows[0]
    file = write_contacts(tmp_path / "new.csv", rows)
    robot = write_socket_robot(tmp_path)
    cell.calibration.write(tmp_path / "out")
    arguments = [str(robot), str(file), "--estimates", str(tmp_path / "out")]
    if change == "refit":
        arguments += ["--refit", "point"]
    if change == "mixed":
        q = postures(rng, 4)
        arguments.insert(2, str(write_poses(tmp_path / "points.csv", q, cell.arm.points(q), None)))
    verb = ["verify", *arguments]
    if change == "map":
        estimates = ["--estimates", str(tmp_path / "out")]
        verb = [
            "map",
            str(robot),
            "--verification",
            str(file),
            *estimates,
            "--out",
            str(tmp_path / "map.html"),
        ]
    assert main(verb) == 2
    assert_refusal(capsys.readouterr().err, *refusal)


def test_the_page_speaks_of_sockets(cells: list[Cell], tmp_path: Path) -> None:
    found = cells[1].verified(cells[1].arm, 2, 5)
    found.write(tmp_path)
    page = (tmp_path / "report.html").read_text("utf-8")
    for words in ("Distances between sockets", "play of the ball in its socket", "Distance of the ball"):
        assert words in page
    for words in ("instrument", "fresh points", "measured point ", "--refit"):
        assert words not in page, words


def test_points_of_the_fit_cannot_verify(cells: list[Cell]) -> None:
    cell = cells[0]
    found = verify(cell.calibration.robot, read_poses(cell.folder / "fit.csv", cell.model))
    assert found.trust.status == "unknown" and found.fitted


def test_very_many_contacts_are_sampled(cells: list[Cell], monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors at all of them are about the mean of all contacts with a socket."""
    from flexcal.calibration.fit import StratifiedSample

    cell, least = cells[2], StratifiedSample.of
    file = write_contacts(cell.folder / "many.csv", contacts(cell.arm, cell.rng, places=3, postures_each=30))
    poses = read_poses(file, cell.model)
    whole = verify(cell.calibration.robot, poses)
    monkeypatch.setattr(StratifiedSample, "of", lambda rows: least(rows, 60))
    part = verify(cell.calibration.robot, poses)
    assert part.sample is not None and len(part.poses) < 70
    assert part.errors.mean == pytest.approx(whole.errors.mean, rel=1e-9)
    assert part.document()["prediction"]["ratio"] == pytest.approx(1, abs=0.25)
    assert whole.sample is None


def test_errors_are_refused_as_the_library_refuses_them(cells: list[Cell]) -> None:
    cell = cells[0]
    poses = read_poses(cell.folder / "fit.csv", cell.model)
    with pytest.raises(FlexcalError, match="2 postures"):
        verify(cell.calibration.robot, poses.subset(slice(0, 1)))
