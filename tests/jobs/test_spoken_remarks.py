"""Sentences on what was given: of one and of several, inside and outside."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexcal.cli.verbs.calibrate import considered_lines
from flexcal.jobs.inputs.given_temperature import temperature_remarks
from flexcal.jobs.recheck.job import _repeated


@pytest.mark.parametrize(
    ("given", "end"),
    [
        ([38.0], "from 22.1 to 29.6 °C; the given 38.0 °C is 8.4 K outside"),
        ([25.0, 38.0, 20.0], "from 22.1 to 29.6 °C; of those given the farthest, 38.0 °C, is 8.4 K outside"),
        ([25.0], "from 22.1 to 29.6 °C, which includes these"),
    ],
)
def test_temperatures_outside_those_of_the_calibration(
    given: list[float], end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flexcal.jobs.inputs.given_temperature.depends_on_temperature", lambda model: False)
    block = SimpleNamespace(ranges={"temperature": (22.1, 29.6)})
    robot: Any = SimpleNamespace(model=None, blocks={"calibration": block})
    (said,) = temperature_remarks(robot, np.array(given), "errors")
    assert said.endswith(f"errors are for the temperatures at which it was measured, {end}")


def test_readings_of_a_visit_before() -> None:
    readings: Any = SimpleNamespace(pose=range(10), shared=lambda other: other)

    def said(shared: int) -> str | None:
        visit: Any = SimpleNamespace(readings=shared, date="2026-03-01")
        return _repeated(readings, [visit])

    one, four = said(1), said(4)
    assert said(0) is None and one is not None and four is not None
    assert "one of the 10 readings is that of the visit of 2026-03-01" in one and "it tells nothing" in one
    assert "4 of the 10 readings are those of the visit" in four and "they tell nothing" in four


def test_waves_that_were_left_and_their_term_that_is_fitted() -> None:
    rows = [{"term": None}, {"term": "transmission_1", "taken": False, "reason": "it is not supported"}]
    lines = considered_lines(rows, ("kinematic", "transmission"))
    assert lines[0] == "considered transmission_1: left, because it is not supported"
    assert lines[1].startswith("fitted in place of transmission_1 and so on, taken or left: transmission, ")
    assert len(considered_lines(rows, ("kinematic",))) == 1
