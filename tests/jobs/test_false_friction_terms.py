"""Friction terms that are not there: selection finds none in logs whose noise remembers itself, and finds the one that is."""

from pathlib import Path

import pytest
from over_seeds import over_seeds
from planar_arm import Log

from flexcal.jobs.dynamics import identify_robot_dynamics


def selected(seed: int, folder: Path, log: Log) -> tuple[str, ...]:
    """Friction terms beside those that every joint has."""
    (folder := folder / str(seed)).mkdir()
    robot, path = log.write(folder, seed, friction="auto")
    return identify_robot_dynamics(robot, [path]).friction.names[3:]


def false_terms(folder: Path, memory: float, seeds: range) -> list[tuple[str, ...]]:
    log = Log(torque_noise=0.5, memory=memory)
    found = over_seeds(selected, seeds, folder, log)
    print(f"memory {memory} s: a false term in {sum(map(bool, found))} of {len(seeds)} logs")
    return [names for names in found if names]


def test_noise_with_a_memory_is_no_friction(tmp_path: Path) -> None:
    assert false_terms(tmp_path, 1.5, range(40, 41)) == []


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.05, 0.2, 0.5, 1.5])
def test_no_false_term_in_nineteen_logs_of_twenty(memory: float, tmp_path: Path) -> None:
    assert len(false_terms(tmp_path, memory, range(40))) <= 2


def test_selection_widens_the_intervals(tmp_path: Path) -> None:
    """Stribeck friction of a velocity between those that are tried; a remark says by how much standard deviations grow, if they do."""
    robot, path = Log(torque_noise=0.1, stribeck=4.0, velocity=0.3).write(tmp_path, 3, friction="auto")
    found = identify_robot_dynamics(robot, [path])
    assert "stribeck" in found.friction.names
    spread = found.friction.uncertainty
    remark = found.document()["selection_remark"]
    assert (spread is None) == (remark is None)
    if spread is not None:
        assert min(spread.growth(found.estimate).values()) >= 1.0
