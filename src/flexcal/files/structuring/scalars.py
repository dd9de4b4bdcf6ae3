"""Checked numbers, texts, truth values and choices."""

from __future__ import annotations

import math
from typing import Any, get_args

from flexcal.files.structuring.faults import Fault
from flexcal.files.structuring.wording import describe, suggestion
from flexcal.units import LARGEST, SMALLEST


def number(value: Any) -> float:
    """A finite number below `units.LARGEST`, zero below `units.SMALLEST`; raises `Fault`, as all below."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise Fault("E-YAML-025", f"a number is expected, not {describe(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise Fault("E-YAML-026", f"a finite number is expected, not {describe(value)}")
    if abs(number) > LARGEST:
        raise Fault("E-YAML-027", f"a number below {LARGEST:.0e} is expected, not {number:g}")
    return 0.0 if abs(number) < SMALLEST else number


def integer(value: Any) -> int:
    """A whole number of at most 8 bytes."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise Fault("E-YAML-028", f"a whole number is expected, not {describe(value)}")
    if not -(2**63) <= value < 2**63:
        raise Fault("E-YAML-029", f"a whole number of at most 8 bytes is expected, not {value:.3g}")
    return value


def text(value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        quotes = "; write it in quotes" if isinstance(value, int | float) else ""
        raise Fault("E-YAML-030", f"a text is expected, not {describe(value)}{quotes}")
    return value


def boolean(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise Fault("E-YAML-031", f"true or false is expected, not {describe(value)}")
    return value


def literal(value: Any, cls: Any) -> Any:
    """One of the choices of a `Literal`."""
    choices = get_args(cls)
    for choice in choices:
        if type(choice) is type(value) and choice == value:
            return choice
    near = suggestion(value, [str(choice) for choice in choices]) if isinstance(value, str) else ""
    listed = ", ".join(f"'{choice}'" for choice in choices)
    raise Fault("E-YAML-032", f"{describe(value)} is none of {listed}{near}")
