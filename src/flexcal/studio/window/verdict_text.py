"""The first screen of a report as text."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from flexcal.studio.window.markup import Tone, paragraph

if TYPE_CHECKING:
    from flexcal.report.layout import Check, Fact, Verdict

_TONES: dict[str, Tone] = {"good": "good", "care": "warning", "bad": "bad", "unknown": "faint"}


def verdict_text(verdict: Verdict, *, tally: bool = True) -> str:
    """HTML of a verdict: its facts, its sentence, with `tally` how many checks are good, and those that are not."""
    facts = "".join(_fact(fact) for fact in verdict.facts)
    reserved = [check for check in verdict.checks if check.status != "good"]
    return (
        f'<div style="display:flex;gap:1em;margin:0.4em 0.5em;">{facts}</div>'
        + paragraph(verdict.headline, _TONES[verdict.status])
        + paragraph(verdict.sentence)
        + (paragraph(f"{verdict.tally}.", "faint") if verdict.checks and tally else "")
        + "".join(_check(check) for check in reserved)
    )


def _fact(fact: Fact) -> str:
    return (
        f'<div style="flex:1;font-size:0.75em;line-height:1.3;" title="{escape(fact.detail, quote=True)}">'
        f"{escape(fact.question)}"
        f'<div style="font-size:1.9em;font-weight:600;">{escape(fact.value)} '
        f'<span style="font-size:0.5em;font-weight:400;">{escape(fact.unit)}</span></div></div>'
    )


def _check(check: Check) -> str:
    return paragraph(f"{check.question} {check.answer}", _TONES[check.status])
