"""Causes that a recheck names: alone only where others are excluded, after noise and drift of the readings, by an own simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm
from rechecked_arm import judged_beside
from test_recheck import Visited

from flexcal import recheck
from flexcal.data.poses import PoseSet

_MECHANICAL = {"joint_shifted", "tool_bumped", "thermal_growth", "ambiguous", "recalibrate"}


@pytest.fixture(scope="module")
def visited(tmp_path_factory: pytest.TempPathFactory) -> Visited:
    return Visited(tmp_path_factory.mktemp("arm"), 5)


def _again(visited: Visited) -> PoseSet:
    return visited.shop.measured(visited.robot.model, np.repeat(visited.q, 3, axis=0))


def test_a_small_shift_is_not_told_as_another_cause(visited: Visited) -> None:
    """Shifts that are found at times: the true joint is hardly ever excluded, and no other is named alone."""
    missed, named = 0, 0
    for k in range(30):
        shifted = visited.visit(arm=visited.shop.arm.turned(2 + k % 2, 7e-5))
        judged = judged_beside(visited.robot.model, shifted, _again(visited))
        if not judged.suspects:
            continue
        subjects = [suspect.change.subject for suspect in judged.suspects]
        named += 1
        missed += f"joint_{2 + k % 2}" not in subjects
    assert named > 10 and missed <= 1, (missed, named)


def test_the_p_value_is_that_of_a_change_and_not_of_its_cause(visited: Visited) -> None:
    arm = visited.shop.arm
    alone = visited.judged(arm=arm.turned(3, 1e-3)).headline
    assert "(beyond chance: p < 1e-4; no other single change explains the readings)" in alone
    both = visited.judged(arm=arm.turned(6, 6e-3)).headline
    assert both.startswith("something changed (p < 1e-4), and these readings do not tell which")


@pytest.mark.parametrize("visits", [7, pytest.param(25, marks=pytest.mark.slow)])
def test_a_noisier_instrument_is_no_change_of_the_robot(
    visited: Visited, tmp_path: Path, visits: int
) -> None:
    """An instrument of nearly twice the noise, and nothing else: most alarms say so, alone or beside what explains them as well."""
    shop = replace(visited.shop, folder=tmp_path, rng=np.random.default_rng(8))
    alarms, mechanical, factors = 0, 0, []
    for _ in range(visits):
        visit = shop.measured(visited.robot.model, visited.q)
        noise = 1.7 * 3e-5 * shop.rng.normal(size=visit.position.shape)
        judged = judged_beside(
            visited.robot.model, replace(visit, position=visit.position + noise), _again(visited)
        )
        if judged.as_calibrated:
            continue
        alarms += 1
        noisier = judged.scatter is not None or "noisier_readings" in {
            suspect.change.kind for suspect in judged.suspects
        }
        mechanical += judged.verdict in _MECHANICAL and not noisier
        factors += [judged.scatter.factor] if judged.scatter is not None else []
    assert alarms > 0.25 * visits and mechanical <= max(1, 0.15 * alarms), (mechanical, alarms)
    assert 1.5 < np.median(factors) < 2.6
    verdicts = []
    for _ in range(6):
        visit = visited.visit()
        noise = 8e-5 * shop.rng.normal(size=(10, 3))
        found = recheck(
            visited.robot, replace(visit, position=visit.position + noise), reference=visited.reference
        )
        verdicts.append(found.verdict)
        if found.verdict == "noisier_readings":
            assert (
                found.headline.startswith("the readings scatter ")
                and "check the instrument" in found.headline
            )
            assert "cannot be told" in found.headline
    assert verdicts.count("noisier_readings") >= 3 and not _MECHANICAL & set(verdicts), verdicts


def test_another_robot_is_no_noisier_instrument(visited: Visited) -> None:
    """Six other arms of the type, before the same instrument: too much for single changes, and for scatter."""
    for seed in range(200, 206):
        visit = visited.shop.measured(visited.robot.model, visited.q, arm=DHArm.made(seed))
        for reference in (None, visited.reference):
            found = recheck(visited.robot, visit, reference=reference)
            assert found.verdict == "recalibrate", (seed, found.headline)
            assert "another robot" in found.headline or "is this the robot" in found.headline, found.headline


def test_a_shift_beyond_a_larger_scatter_is_still_named(visited: Visited) -> None:
    rng = np.random.default_rng(3)
    shifted = visited.visit(arm=visited.shop.arm.turned(2, 1.5e-3))
    position = shifted.position + 6e-5 * rng.normal(size=(10, 3))
    judged = judged_beside(visited.robot.model, replace(shifted, position=position), visited.reference)
    (item,) = judged.suspects
    assert judged.scatter is not None and item.change.subject == "joint_2"
    assert abs(item.estimate[0] - 1.5e-3) < 4 * item.std[0]


def test_a_drift_during_the_visit_is_no_other_place_of_the_instrument(visited: Visited) -> None:
    visit = visited.visit()
    drifting = visit.position + np.linspace(0, 1, 10)[:, None] * (1.2e-4, -6e-5, 5e-5)
    found = recheck(visited.robot, replace(visit, position=drifting), reference=visited.reference)
    best = found.judged.suspects[0]
    assert best.change.kind == "readings_drift" and found.judged.instrument == "known"
    assert np.all(np.abs(best.estimate - (1.2e-4, -6e-5, 5e-5)) < 4 * best.std)
    assert "drifted by" in found.headline and "from the first pose of the visit to the last" in found.headline
