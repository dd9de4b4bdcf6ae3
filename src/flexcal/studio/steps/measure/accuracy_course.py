"""Predicted accuracy against the number of measured poses, as a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexcal.units import MILLIMETRE

_WIDTH, _HEIGHT = 360, 190
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 10, 12, 32


def accuracy_course(
    course: Mapping[int, float], ahead: Sequence[float], measured: int, wanted: float | None
) -> str:
    """SVG of the predicted 90 % quantile of the tool error over the number of rows, on a logarithmic axis.

    Parameters
    ----------
    course : mapping of float
        Predicted error, m, by number of rows so far.
    ahead : sequence of float
        Predicted error, m, after none, one, two, … of the next poses, drawn dashed.
    measured : int
        Number of rows now.
    wanted : float or None
        Error, m, at which to stop.
    """
    past = {count: error / MILLIMETRE for count, error in course.items()}
    future = {measured + k: error / MILLIMETRE for k, error in enumerate(ahead)}
    values = [*past.values(), *future.values(), *([] if wanted is None else [wanted / MILLIMETRE])]
    counts = [*past, *future]
    if not counts:
        return ""
    bottom, top = 10 ** np.floor(np.log10(min(values))), 10 ** np.ceil(np.log10(max(values)) + 1e-9)
    first, last = min(counts), max(max(counts), min(counts) + 1)

    def x(count: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (count - first) / (last - first)

    def y(error: float) -> float:
        share = np.log10(error / bottom) / np.log10(top / bottom)
        return float(_HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * share)

    parts = [_level(y(10.0**k), f"{10.0**k:g}") for k in range(_power(bottom), _power(top) + 1)]
    step = max(1, round((last - first) / 6))
    parts += [_count(x(k), k) for k in range(first, last + 1) if (k - first) % step == 0]
    if wanted is not None:
        height = y(wanted / MILLIMETRE)
        parts.append(
            f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{height:.1f}" y2="{height:.1f}" stroke="#2b8a3e" stroke-dasharray="2 3"/>'
            f'<text x="{_WIDTH - _RIGHT}" y="{height - 3:.1f}" text-anchor="end" fill="#2b8a3e">wanted</text>'
        )
    parts.append(_line([(x(n), y(e)) for n, e in future.items()], "#f08c00", dashed=True))
    parts.append(_line([(x(n), y(e)) for n, e in past.items()], "#3a82e0"))
    parts += [_point(x(n), y(e), f"{n} poses: p90 predicted {e:.3f} mm") for n, e in past.items()]
    told = f"predicted p90 of the tool error by number of poses, {_told(past, future)}"
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{told}" style="width:100%;font-size:10px;" fill="currentColor">'
        f"{''.join(parts)}"
        f'<text x="{(_LEFT + _WIDTH - _RIGHT) / 2}" y="{_HEIGHT - 4}" text-anchor="middle">poses measured (dashed: next poses)</text>'
        f'<text x="10" y="{_HEIGHT / 2:.0f}" transform="rotate(-90 10 {_HEIGHT / 2:.0f})" text-anchor="middle">p90 predicted / mm</text>'
        "</svg>"
    )


def _told(past: Mapping[int, float], future: Mapping[int, float]) -> str:
    return "; ".join(
        f"{word} {error:.3f} mm at {count}"
        for word, part in (("now", past), ("then", future))
        for count, error in list(part.items())[-1:]
    )


def _power(value: float) -> int:
    return round(float(np.log10(value)))


def _level(y: float, label: str) -> str:
    return (
        f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="currentColor" opacity="0.2"/>'
        f'<text x="{_LEFT - 5}" y="{y + 3:.1f}" text-anchor="end">{label}</text>'
    )


def _count(x: float, count: int) -> str:
    return f'<text x="{x:.1f}" y="{_HEIGHT - _BOTTOM + 13}" text-anchor="middle">{count}</text>'


def _line(points: Sequence[tuple[float, float]], colour: str, *, dashed: bool = False) -> str:
    at = " ".join(f"{a:.1f},{b:.1f}" for a, b in points)
    dash = ' stroke-dasharray="4 3"' if dashed else ""
    return f'<polyline points="{at}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>'


def _point(x: float, y: float, told: str) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#3a82e0"><title>{told}</title></circle>'
