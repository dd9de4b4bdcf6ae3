"""What is said of scatter that is as large as play in the joints."""

from __future__ import annotations

import pytest

from flexcal.calibration.diagnostics import RepeatabilityFloor


@pytest.mark.parametrize("apart", [True, False])
def test_scatter_is_not_laid_on_the_arm_alone(apart: bool) -> None:
    """A tracker that moved in the middle scatters the points as play does: the sentence names both, and holds only without it."""
    sentence = RepeatabilityFloor(0.0021, 0.0017, apart).sentence
    assert sentence.startswith("2.1 mm (rms)") and "as if every joint had 0.1° of play" in sentence
    assert sentence.index(
        "or something moved between the poses, or the robot while it was read: if nothing did,"
    ) < sentence.index("no calibration goes much below")
