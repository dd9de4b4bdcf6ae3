"""Another robot of the type, and a noisier instrument: told apart by how the errors go together, by an own simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm
from rechecked_arm import judged_beside
from test_recheck import Visited

from flexcal import recheck
from flexcal.jobs.recheck.judgement_words import judgement_sentence


@pytest.fixture(scope="module")
def visited(tmp_path_factory: pytest.TempPathFactory) -> Visited:
    return Visited(tmp_path_factory.mktemp("arm"), 6)


def _like(arm: DHArm, rng: np.random.Generator, size: float) -> DHArm:
    """Another arm of the same workshop, `size` times as different as any two."""
    return DHArm(
        arm.rows + size * rng.normal(size=(6, 4)) * [8e-4, 3e-4, 3e-4, 4e-4],
        arm.tilts + size * 3e-4 * rng.normal(size=6),
        arm.tool + size * 1e-3 * rng.normal(size=3),
    )


def test_another_robot_is_no_noise_and_no_bumped_tool(visited: Visited, tmp_path: Path) -> None:
    """Arms that differ by a third of what the workshop's do, with the instrument set up anew: most are told as robots of another geometry,
    and none as readings that scatter alone.
    """
    shop = replace(visited.shop, folder=tmp_path, rng=np.random.default_rng(3))
    model = visited.robot.model
    said = []
    for _ in range(10):
        visit = shop.measured(model, visited.q, arm=_like(shop.arm, shop.rng, 0.3), place=shop.new_place())
        judged = judged_beside(
            visited.robot.model, visit, shop.measured(model, np.repeat(visited.q, 3, axis=0)), placed=True
        )
        assert not judged.as_calibrated
        said.append(judgement_sentence(judged))
    assert sum("another robot" in text or "is this the robot" in text for text in said) >= 8, said
    assert not any("scatter" in text and "another robot" not in text for text in said), said


def test_a_noisier_instrument_is_no_other_robot(visited: Visited, tmp_path: Path) -> None:
    shop = replace(visited.shop, folder=tmp_path, rng=np.random.default_rng(4))
    model = visited.robot.model
    other = 0
    for _ in range(12):
        visit = shop.measured(model, visited.q, place=shop.new_place())
        noise = 2.5 * 3e-5 * shop.rng.normal(size=visit.position.shape)
        visit = replace(visit, position=visit.position + noise)
        judged = judged_beside(
            visited.robot.model, visit, shop.measured(model, np.repeat(visited.q, 3, axis=0)), placed=True
        )
        other += judged.verdict == "recalibrate"
    assert other <= 1


def test_two_changes_are_said_to_be_several_and_no_wrong_readings(visited: Visited, tmp_path: Path) -> None:
    """Two joints that shifted: together they explain the errors, and neither poses nor the robot as a whole are blamed alone."""
    shop = replace(visited.shop, folder=tmp_path, rng=np.random.default_rng(5))
    model = visited.robot.model
    for one, other in ((3e-4, -6e-4), (2e-4, 5e-4)):
        arm = shop.arm.turned(2, one).turned(5, other)
        visit = shop.measured(model, visited.q, arm=arm)
        found = recheck(visited.robot, visit, reference=shop.measured(model, np.repeat(visited.q, 3, axis=0)))
        pair = "a shift of joint_2 and a shift of joint_5"
        named = f"two together would, as {pair}", f"if it was {pair}"
        assert any(words in found.headline for words in named), found.headline
        assert "disagree" not in found.headline


def test_two_shifts_that_look_like_another_place_are_named_beside_it(
    visited: Visited, tmp_path: Path
) -> None:
    """Two nearly parallel joints turned against each other, which moves the tool as another place of the instrument would."""
    shop = replace(visited.shop, folder=tmp_path, rng=np.random.default_rng(5))
    arm = shop.arm.turned(3, 3e-4).turned(5, -6e-4)
    visit = shop.measured(visited.robot.model, visited.q, arm=arm)
    reference = shop.measured(visited.robot.model, np.repeat(visited.q, 3, axis=0))
    headline = recheck(visited.robot, visit, reference=reference).headline
    assert "stands elsewhere" in headline and "together would explain the readings too" in headline
    assert "a shift of joint_3 and a shift of joint_5" in headline
