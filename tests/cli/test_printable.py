"""Names from files reach the terminal as text: no escape sequence acts, no markup is read."""

from __future__ import annotations

import pytest

from flexcal.cli.terminal.console import Console
from flexcal.printable import LONGEST_SENTENCE, printable, sentence

ODD = "\x1b[31mred\x1b]0;title\x07[/bold][red]:smile:\u202etxt"


def test_control_characters_are_written_out() -> None:
    assert printable("a\x1b[2Jb\x07\x9bc\u202ed\te\n") == "a\\x1b[2Jb\\x07\\x9bc\\u202ed\te\n"
    assert printable("Käse, 20 µm, ☃") == "Käse, 20 µm, ☃"


def test_a_sentence_is_one_line_of_bounded_length() -> None:
    assert sentence("two\r\nlines\x1b") == "two lines\\x1b"
    long = sentence(f"poses.csv line 3: '{'x' * 1_000_000}' is no number; correct it.")
    assert len(long) <= LONGEST_SENTENCE
    assert long.startswith("poses.csv line 3: 'xxx") and long.endswith("is no number; correct it.")


def test_tables_show_names_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    from rich.table import Table

    table = Table(title=ODD)
    table.add_column(ODD)
    table.add_row(ODD)
    Console(json=False).show(table)
    out = capsys.readouterr().out
    assert "\x1b" not in out and "\x07" not in out and "\u202e" not in out
    assert out.count("\\x1b[31mred\\x1b]0;title\\x07[/bold][red]:smile:") == 3


def test_lines_and_stages_show_names_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(json=False)
    console.say(f"wrote {ODD}")
    with console.progress() as advance:
        advance(ODD, 0.5)
    captured = capsys.readouterr()
    for text in (captured.out, captured.err):
        assert "\\x1b[31mred" in text and "\x1b" not in text
