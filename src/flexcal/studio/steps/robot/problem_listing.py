"""Problems of a file beside its lines."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import read_text
from flexcal.jobs.setup import FileProblem
from flexcal.studio.window import paragraph

_AROUND = 2
"""Lines shown before and after."""
_LONGEST = 300
"""Characters of a line that are shown."""
_MOST = 20
"""Problems that are shown."""


def problem_listing(problems: Sequence[FileProblem], folder: Path) -> str:
    """HTML of problems, each with its sentence and the lines around, in which its own is marked; names relative to `folder`."""
    texts = {problem.path: _lines(problem.path) for problem in problems[:_MOST]}
    parts = [_problem(problem, texts[problem.path], folder) for problem in problems[:_MOST]]
    if len(problems) > _MOST:
        parts.append(paragraph(f"and {len(problems) - _MOST} more", "faint"))
    return "".join(parts)


def _problem(problem: FileProblem, lines: Sequence[str], folder: Path) -> str:
    path = problem.path.absolute()
    name = path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name
    place = f"{name}, line {problem.line}, column {problem.column}"
    told = paragraph(f"{place}: {problem.sentence.replace(f'{folder}/', '')} [{problem.code}]", "bad")
    first, last = max(1, problem.line - _AROUND), min(len(lines), problem.line + _AROUND)
    shown = [_line(number, lines[number - 1], problem) for number in range(first, last + 1)]
    return told + (
        f'<pre tabindex="0" aria-label="{escape(place, quote=True)}" style="font-size:0.75em;line-height:1.5;margin:0.1em 0.7em 0.8em;'
        'overflow-x:auto;border:1px solid rgba(128,128,128,0.4);border-radius:3px;padding:0.2em 0;">'
        f'<div style="display:inline-block;min-width:100%;">{"".join(shown)}</div></pre>'
        if shown
        else ""
    )


def _line(number: int, text: str, problem: FileProblem) -> str:
    own = number == problem.line
    sign = "▶" if own else " "
    style = "background:rgba(224,49,49,0.22);font-weight:600;" if own else "opacity:0.8;"
    return f'<div style="{style}padding:0 0.4em;">{sign}{number:>4}  {escape(text[:_LONGEST])}</div>'


def _lines(path: Path) -> list[str]:
    try:
        return read_text(path, encoding="utf-8-sig", errors="replace").splitlines()
    except (InputError, OSError):
        return []
