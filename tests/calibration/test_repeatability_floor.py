"""What is said of scatter that is as large as play in the joints."""

from __future__ import annotations

import pytest

from flexcal.calibration.diagnostics import RepeatabilityFloor


@pytest.mark.parametrize("apart", [True, False])
def test_scatter_is_not_laid_on_the_arm_alone(apart: bool) -> None:
    """A tracker that moved in the middle scatters the points as play does, and so do terms that are not fitted: all are named."""
    sentence = RepeatabilityFloor(0.0021, 0.0017, apart).sentence
    assert sentence.startswith("2.1 mm (rms)") and "as of 0.097° at every joint" in sentence
    for cause in ("repeat", "something moved", "errors beyond the terms"):
        assert cause in sentence
