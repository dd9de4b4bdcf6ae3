"""Estimates whose interval ends at a bound: one-sided, told as a limit, and covering."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from rich.console import Console

from flexcal.cli.tables.results import quantity_table
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.jobs.calibration.remarks import negative_compliances
from flexcal.report.layout import interval_words


def estimate(value: float, std: float, lower: float = -np.inf, name: str = "joint_2.backlash") -> Estimate:
    return Estimate(
        Parameters([Parameter(name, "rad", value, lower=lower)]),
        np.array([[std**2]]),
        1,
        (),
        (True,),
        0.0,
        0.0,
        1000,
        "converged",
        "",
        1,
    )


@pytest.mark.parametrize("value", [0.0, 0.05, 0.2])
def test_an_interval_that_ends_at_a_bound_is_a_limit(value: float) -> None:
    found = estimate(value, 0.131, lower=0.0)
    high = value + 1.96 * 0.131
    assert found.bound("joint_2.backlash") == "lower"
    assert found.interval("joint_2.backlash") == pytest.approx((0.0, high), abs=1e-4)
    assert found.spread("joint_2.backlash", 100.0) == f"at most {100 * high:.2g}"
    assert interval_words(found, "joint_2.backlash", lambda v: f"{v:.3f}") == f"at most {high:.3f}"
    console = Console(width=200, record=True)
    console.print(quantity_table("", {"b": found.quantity("joint_2.backlash")}, {}))
    assert "at a bound" in console.export_text()


def test_an_interval_within_the_bounds_has_two_sides() -> None:
    found = estimate(0.5, 0.1, lower=0.0)
    assert found.bound("joint_2.backlash") is None
    assert found.spread("joint_2.backlash") == "± 0.1"
    assert interval_words(found, "joint_2.backlash", lambda v: f"{v:.1f}") == "0.3 to 0.7"


@pytest.mark.parametrize("truth", [0.0, 0.5, 1.0, 1.7, 2.5])
def test_intervals_at_a_bound_cover(truth: float, rng: np.random.Generator) -> None:
    """The nearest value within the bounds to one with unit noise; 2000 draws tell the share to 0.5 %."""
    drawn = np.maximum(truth + rng.standard_normal(2000), 0.0)
    intervals = [estimate(float(value), 1.0, lower=0.0).interval("joint_2.backlash") for value in drawn]
    assert np.mean([low <= truth <= high for low, high in filter(None, intervals)]) > 0.94


@pytest.mark.parametrize("key", ["gravity_compliance", "gravity_compliance_2"])
def test_a_compliance_that_is_surely_negative_is_said(key: str) -> None:
    name = f"joint_3.{key}"

    def said(value: float, *, of: str = name, moved: float = 1e-4) -> Sequence[str]:
        return negative_compliances(estimate(value, 1e-6, name=of), lambda names: np.full(len(names), moved))

    assert "joint_3 (−4.1 ± 1" in said(-4.1e-6)[0]
    assert said(-2.9e-6) == said(-4.1e-6, of="joint_3.offset") == ()
    # what moves no point by more than the best robots repeat to has no cause to look for
    assert said(-4.1e-6, moved=5e-6) == ()
