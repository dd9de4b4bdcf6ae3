"""Checks of a verification that instrument and reflector are those of the calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.report.page import Check


def check_known_points(uncalibrated: Sequence[str]) -> Check:
    """Of points `uncalibrated` that no calibration pose measured."""
    return Check(
        "Did the calibration measure these points?",
        f"Not {' and '.join(uncalibrated)}: where it is on the tool is as declared, and an error of that is in these numbers. "
        "flexcal verify --refit point finds it from these poses.",
        "care",
    )


def check_moved(proposed: Mapping[str, Any]) -> Check:
    """Of what would leave less than half of the errors if placed again, as results.json has it under `refit_proposed`."""
    what = " and ".join(
        {"station": "instrument", "point": "measured point"}[name] for name in proposed["what"]
    )
    return Check(
        "Are instrument and measured point where they were at the calibration?",
        f"No: with the {what} placed again the mean error is {proposed['mean_mm']:.3f} mm. "
        f"flexcal verify --refit {' '.join(proposed['what'])} verifies the geometry alone.",
        "bad",
    )
