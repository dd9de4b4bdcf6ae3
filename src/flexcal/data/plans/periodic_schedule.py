"""Checks common to all plans of periodic experiments."""

from __future__ import annotations

from typing import Protocol

from flexcal.errors import FlexcalError

_MAX_SAMPLES = 1e8


class PeriodicSchedule(Protocol):
    """Rates, periods, payload (kg) and seed of a plan whose excitation repeats itself at `base_frequency_hz`."""

    @property
    def base_frequency_hz(self) -> float: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def periods(self) -> int: ...
    @property
    def settle_periods(self) -> int: ...
    @property
    def payload(self) -> float | None: ...
    @property
    def seed(self) -> int: ...


def check_schedule(plan: PeriodicSchedule) -> None:
    """Raise `FlexcalError` for invalid values."""
    if not (plan.base_frequency_hz > 0 and plan.rate_hz > 0):
        raise FlexcalError("E-PLAN-016", "base_frequency_hz and rate_hz must be positive.")
    if plan.rate_hz / plan.base_frequency_hz * max(plan.periods, 1) > _MAX_SAMPLES:
        raise FlexcalError(
            "E-PLAN-017",
            f"{plan.periods} periods at base_frequency_hz {plan.base_frequency_hz:g} last {plan.periods / plan.base_frequency_hz:.3g} s, "
            f"longer than a recording at {plan.rate_hz:g} Hz can be; raise base_frequency_hz.",
        )
    if not 0 <= plan.settle_periods < plan.periods:
        raise FlexcalError(
            "E-PLAN-018",
            f"settle_periods is {plan.settle_periods} of {plan.periods} periods; keep at least one.",
        )
    if plan.payload is not None and plan.payload < 0:
        raise FlexcalError("E-PLAN-019", f"the payload is {plan.payload:g} kg; it must not be negative.")
    if plan.seed < 0:
        raise FlexcalError("E-PLAN-020", f"the seed is {plan.seed}; it must not be negative.")
