"""Logs of any length: read in blocks they give what they give as a whole, in memory that does not grow, in any number of processes."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.data.recordings import Decimation, Recording, read_recording, write_recording
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.estimators.column_noise import PerturbedLog
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, assemble_regression, regression_blocks
from flexcal.dynamics.signals import JointLog, Motion, Window, joint_log
from flexcal.jobs.dynamics.remarks import dynamics_remarks
from flexcal.jobs.logs import LogSegment, Preprocessing, assemble_log_systems, read_logs
from flexcal.jobs.logs.regression_systems import split_hold_out
from flexcal.parallel import ThisProcess, Workers, open_workers
from flexcal.progress import silent

STEP = 1 / 200


@pytest.fixture
def logs(swing: Motion, tmp_path: Path) -> list[Path]:
    rng = np.random.default_rng(9)
    paths = [tmp_path / "one.parquet", tmp_path / "two.csv"]
    for path in paths:
        torque = 20.0 * np.cos(swing.q) + 0.1 * rng.normal(size=swing.q.shape)
        write_recording(path, Recording(STEP, swing.q, torque, start=1.0))
    return paths


def test_blocks_give_the_whole(
    logs: list[Path], observation: Observation, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(joint_log, "_ROWS", 333)
    for path in logs:
        log = JointLog.read(path, observation.model, 10.0, tmp_path)
        whole = read_recording(path, observation.model)
        motion = Motion.of(whole, 10.0)
        assert (log.samples, log.span) == (len(motion), (1.0, pytest.approx(1.0 + whole.duration)))
        np.testing.assert_allclose(log.top_speed, motion.top_speed, rtol=1e-12)
        assert sum(1 for _ in log.blocks()) > 3
        parts = Motion.joined(log.blocks())
        np.testing.assert_allclose(parts.time, motion.time, atol=1e-12)
        np.testing.assert_allclose(parts.ddq, motion.ddq, atol=1e-10)
        estimates = [
            weighted_least_squares(
                assemble_regression(observation, BaseParameters.of(observation), [experiment], Decimation(2))
            )
            for experiment in (log, motion)
        ]
        coordinates = [e.parameters.coordinates() for e in estimates]
        np.testing.assert_allclose(coordinates[0], coordinates[1], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(estimates[0].covariance, estimates[1].covariance, rtol=1e-8, atol=1e-18)


def systems(
    logs: list[Path], observation: Observation, scratch: Path, workers: Workers
) -> list[ExperimentSystem]:
    """Those of the first 70 % and of the rest of every log."""
    treatment, parts = Preprocessing(10.0, Decimation(4), True), []
    for log in read_logs(logs, observation.model, treatment, scratch, workers=workers):
        early, late = split_hold_out(log, treatment, 0.3)
        assert late is not None
        parts += [LogSegment(log, early), LogSegment(log, late)]
    return assemble_log_systems(parts, observation, treatment, batches=16, workers=workers, progress=silent)


def check_equal(found: list[ExperimentSystem], expected: list[ExperimentSystem]) -> None:
    for one, other in zip(found, expected, strict=True):
        for mine, theirs in zip(one.batches, other.batches, strict=True):
            assert (mine.number, mine.rows) == (theirs.number, theirs.rows)
            for factor, same in zip(mine.factors, theirs.factors, strict=True):
                np.testing.assert_allclose(factor, same, rtol=0, atol=1e-12)


def test_processes_change_nothing(logs: list[Path], observation: Observation, tmp_path: Path) -> None:
    with open_workers(None, 2) as workers:
        found = systems(logs, observation, tmp_path, workers)
    check_equal(found, systems(logs, observation, tmp_path, ThisProcess()))


def test_a_window_reads_no_more_than_it_needs(swing: Motion, observation: Observation) -> None:
    """The rows of a window are those that all rows have there, number and all."""
    decimation = Decimation(4)
    everything = list(regression_blocks(observation, swing, decimation, Window()))
    number, time = (np.concatenate([getattr(part, key) for part in everything]) for key in ("number", "time"))
    np.testing.assert_array_equal(number, np.arange(len(number)))
    np.testing.assert_allclose(time, swing.time[decimation.support :: 4][: len(time)])
    part = list(regression_blocks(observation, swing, decimation, Window(6.0, 7.0)))
    inside = (time >= 6.0) & (time < 7.0)
    np.testing.assert_array_equal(np.concatenate([p.number for p in part]), number[inside])
    for joint in range(6):
        found = np.hstack([p.columns[joint] for p in part])
        expected = np.hstack([p.columns[joint] for p in everything])[:, inside]
        np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.fixture
def divided(logs: list[Path]) -> tuple[Path, list[Recording]]:
    """A log with two gaps and, between them, a part that is too short for the filter; and what lies before and after."""
    path = logs[1]
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:801] + lines[901:951] + lines[1101:]))
    table = np.loadtxt(lines[1:], delimiter=",")
    parts = [table[:800], table[1100:]]
    return path, [Recording(STEP, part[:, 1:7], part[:, 7:], start=float(part[0, 0])) for part in parts]


def test_nothing_reaches_across_a_gap(
    divided: tuple[Path, list[Recording]], observation: Observation, tmp_path: Path
) -> None:
    """A log with gaps has the rows of two logs, with numbers of their own, whatever the blocks are."""
    path, parts = divided
    log = JointLog.read(path, observation.model, 10.0, tmp_path)
    motions = [Motion.of(part, 10.0) for part in parts]
    assert log.spans == tuple((p.start, pytest.approx(p.start + p.duration)) for p in parts)
    assert "divided at 2 gaps, the longest of 0.755 s" in log.time_stamps
    assert "0.25 s between gaps are too short for the filters and left out" in log.time_stamps
    joined = Motion.joined(log.blocks())
    np.testing.assert_allclose(joined.ddq, np.concatenate([m.ddq for m in motions]), atol=1e-8)
    found = list(regression_blocks(observation, log, Decimation(4), Window()))
    expected = [list(regression_blocks(observation, motion, Decimation(4), Window())) for motion in motions]
    number = np.concatenate([part.number for part in found])
    assert (np.diff(number) > 0).all() and number[-1] <= log.samples // 4
    for joint in range(6):
        mine, theirs = (
            np.hstack([part.columns[joint] for part in each])
            for each in (found, [*expected[0], *expected[1]])
        )
        np.testing.assert_allclose(mine, theirs, atol=1e-8)
    total = sum(part.duration for part in parts)
    assert log.last(0.3) == pytest.approx(parts[1].start + parts[1].duration - 0.3 * total)
    assert log.last(0.95) == pytest.approx(parts[0].start + 0.05 * total)


def test_no_room_for_the_filtered_log(logs: list[Path], observation: Observation, tmp_path: Path) -> None:
    with refused("E-DYN-033", "No such file"):
        JointLog.read(logs[0], observation.model, 10.0, tmp_path / "nowhere")


def test_a_joint_that_never_moves(swing: Motion, observation: Observation, tmp_path: Path) -> None:
    """The noise of its encoder is no motion; its drive is named as not seen, the others are identified."""
    rng, path = np.random.default_rng(2), tmp_path / "log.csv"
    q = swing.q.copy()
    q[:, 1] = 0.4 + 1e-5 * rng.normal(size=len(q))
    write_recording(path, Recording(STEP, q, 20.0 * np.cos(q) + rng.normal(size=q.shape)))
    log = JointLog.read(path, observation.model, 10.0, tmp_path)
    motion = Motion.joined(log.blocks())
    assert not motion.dq[:, 1].any() and not motion.ddq[:, 1].any()
    assert np.ptp(motion.q[:, 1]) == 0 and abs(motion.q[0, 1] - 0.4) < 1e-5
    noisy = Motion.joined(PerturbedLog(log, observation.model, np.full(6, 1e-4), 1).blocks())
    assert not noisy.dq[:, 1].any() and np.ptp(noisy.q[:, 1]) == 0
    data = assemble_regression(observation, BaseParameters.of(observation), [log], Decimation(2))
    assert data.silent == ("joint_2.rotor_inertia", "joint_2.viscous", "joint_2.coulomb")
    estimate = weighted_least_squares(data)
    assert not set(data.silent) & {n for n, k in zip(data.names, estimate.identifiable, strict=True) if k}
    assert dynamics_remarks(data, estimate)[0] == (
        "joint_2: rotor_inertia, viscous, coulomb keep their values: these recordings do not excite them"
    )
