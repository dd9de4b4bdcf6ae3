"""The legend of colours."""

from __future__ import annotations

from html import escape

from flexcal.studio.scene import ColourScale

_STEPS = 24
_TICKS = 5


def legend(scale: ColourScale, title: str, unit: str) -> str:
    """HTML of a scale from its first value to its last, with numbers; values beyond have the first and the last colour."""
    colours = ",".join(f"rgb({r},{g},{b})" for r, g, b in scale.steps(_STEPS).tolist())
    span = scale.largest - scale.smallest
    ticks = [f"{scale.smallest + span * k / (_TICKS - 1):.3g}" for k in range(_TICKS)]
    if scale.smallest > 0:
        ticks[0] = f"≤ {ticks[0]}"
    ticks[-1] = f"≥ {ticks[-1]}"
    numbers = "".join(f"<span>{escape(tick)}</span>" for tick in ticks)
    told = f"{title}, {unit}: from {ticks[0]} to {ticks[-1]}"
    return (
        f'<div role="img" aria-label="{escape(told, quote=True)}" style="margin:0.3em 0.6em 0.6em;font-size:0.8em;">'
        f"<div>{escape(title)} / {escape(unit)}</div>"
        f'<div style="height:0.9em;border-radius:2px;background:linear-gradient(to right,{colours});"></div>'
        f'<div style="display:flex;justify-content:space-between;">{numbers}</div></div>'
    )
