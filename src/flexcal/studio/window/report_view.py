"""A report in the window: verdict and sections beside the scene, figures on the other side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexcal.studio.window.markup import folded, paragraph, table
from flexcal.studio.window.verdict_text import verdict_text

if TYPE_CHECKING:
    import viser

    from flexcal.report.layout import Page, Section, Table


def add_verdict(gui: viser.GuiApi, page: Page, *, tally: bool = True, below: str = "") -> None:
    """Add the verdict of a page at the current place, with `tally` how many checks are good; folded `below` a title where one is given."""
    text = verdict_text(page.verdict, tally=tally)
    gui.add_html(folded(below, text) if below else text)


def add_sections(gui: viser.GuiApi, page: Page) -> None:
    """Add the sections of a page, folded, at the current place; its figures are `ReportFigures`.

    They open by mouse and keyboard.
    """
    parts = {section.title: _section(section) for section in page.sections}
    gui.add_html("".join(folded(title, content) for title, content in parts.items() if content))


def _section(section: Section) -> str:
    parts = [paragraph(section.lead, "faint")] if section.lead else []
    for block in section.blocks:
        if block.kind == "table":
            parts.append(_table(block))
        elif block.kind == "text":
            parts += [paragraph(block.title)] if block.title else []
            parts += [paragraph(text) for text in (*block.paragraphs, *block.points)]
    return "".join(parts)


def _table(block: Table) -> str:
    rows = [[text or "" for text in row] for row in block.rows]
    note = paragraph(block.note, "faint") if block.note else ""
    return paragraph(block.caption) + table(block.columns, rows) + note
