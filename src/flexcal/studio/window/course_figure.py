"""Errors of the poses in measuring order, as a figure whose points can be picked."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

_WIDTH, _HEIGHT = 360, 200
_LEFT, _RIGHT, _TOP, _BOTTOM = 44, 8, 10, 30


def error_course(keys: Sequence[str], errors_mm: np.ndarray, chosen: str | None, *, word: str) -> str:
    """SVG of errors (N,), mm, against the order of measuring; each point is a link to `pick/KEY`, for mouse and keyboard.

    `word` names the error in the axis title and the tooltips, such as 'distance to the measured point'.
    """
    count, largest = len(keys), float(np.max(errors_mm, initial=0.0)) or 1.0
    step = _round(largest / 4)
    top = step * np.ceil(largest / step)
    x = _LEFT + (_WIDTH - _LEFT - _RIGHT) * (np.arange(count) + 0.5) / max(count, 1)
    y = _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * np.asarray(errors_mm) / top
    radius = 4.0 if count <= 100 else 2.5
    grid = "".join(
        _line(_HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * v / top, v) for v in _ticks(top, step)
    )
    points = [
        _point(key, float(a), float(b), float(e), radius, word)
        for key, a, b, e in zip(keys, x, y, errors_mm, strict=True)
    ]
    marked = [i for i, key in enumerate(keys) if key == chosen]
    rings = "".join(
        f'<circle cx="{x[i]:.1f}" cy="{y[i]:.1f}" r="7" fill="none" stroke="#f0b214" stroke-width="2.5"/>'
        for i in marked
    )
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="group" aria-label="{escape(word, quote=True)} of {count} poses in measuring '
        'order" style="width:100%;font-size:10px;" fill="currentColor">'
        f'{grid}<text x="{_LEFT}" y="{_HEIGHT - 4}">measuring order</text>'
        f'<text x="10" y="{_HEIGHT / 2:.0f}" transform="rotate(-90 10 {_HEIGHT / 2:.0f})" text-anchor="middle">'
        f"{escape(word)} / mm</text>{''.join(points)}{rings}</svg>"
    )


def _point(key: str, x: float, y: float, error: float, radius: float, word: str) -> str:
    told = escape(f"pose {key}: {word} {error:.3f} mm", quote=True)
    return (
        f'<a href="pick/{escape(key, quote=True)}" aria-label="{told}"><circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" '
        f'fill="#3a82e0"><title>{told}</title></circle></a>'
    )


def _line(y: float, value: float) -> str:
    return (
        f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="currentColor" opacity="0.2"/>'
        f'<text x="{_LEFT - 5}" y="{y + 3:.1f}" text-anchor="end">{value:g}</text>'
    )


def _ticks(top: float, step: float) -> list[float]:
    return [float(f"{k * step:.6g}") for k in range(round(top / step) + 1)]


def _round(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(m for m in (1, 2, 5) if m * power <= value * 1.0001))
