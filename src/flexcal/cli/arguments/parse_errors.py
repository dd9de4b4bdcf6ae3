"""Error messages of arguments that cannot be parsed, in one sentence."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile

from flexcal.cli.arguments.verb_options import options_of
from flexcal.cli.arguments.verb_table import Verb
from flexcal.errors import InputError
from flexcal.files.structuring import suggestion

_RULE = re.compile(r"^\s*[─━-]{3,}\s*$")
_FRAME = str.maketrans("│|", "  ")


def refuse_unknown_options(verb: Verb, arguments: Sequence[str]) -> None:
    """Raise `InputError` at the first argument before `--` that looks like an option of the verb and is none, with the nearest."""
    known = [option.name for option in options_of(verb)]
    for argument in takewhile(lambda argument: argument != "--", arguments):
        name = argument.partition("=")[0]
        if not name.startswith("--") or name == "--help":
            continue
        plain = name.replace("_", "-")
        if plain not in known:
            near = suggestion(plain, known) or f"; there are {', '.join(known)}."
            raise InputError("E-CLI-001", f"'flexcal {verb.name}' has no option {name}{near}")


def parse_error(verb: Verb, said: str) -> InputError:
    """Message of the parser's box, as one sentence."""
    told = _told(said)
    explained = f"'flexcal {verb.name} --help' explains."
    if told and told[0].startswith("Missing from"):
        depth = min(len(line) - len(line.lstrip()) for line in told[1:])
        needed = [line.strip() for line in told[1:] if line[depth] != " "]
        return InputError("E-CLI-002", f"'flexcal {verb.name}' needs {', '.join(needed)}; {explained}")
    if told and told[0].startswith("Unrecognized options:"):
        left = told[0].partition(":")[2].strip()
        return InputError("E-CLI-003", f"'flexcal {verb.name}' does not take {left}; {explained}")
    sentence = " ".join(line.strip() for line in told).rstrip(".").replace(". Expected", "; expected")
    sentence = re.sub(
        r"invalid literal for int\(\) with base 10: ('.*?')", r"\1 is no whole number", sentence
    )
    sentence = re.sub(r"could not convert string to float: ('.*?')", r"\1 is no number", sentence)
    return InputError("E-CLI-004", f"{sentence[:1].lower()}{sentence[1:]}; {explained}")


def _told(said: str) -> list[str]:
    """The lines of a box up to its first rule inside, without the title; its frame is drawn, or blank on terminals with few letters."""
    sections: list[list[str]] = [[]]
    for line in said.splitlines():
        text = line.translate(_FRAME).rstrip()
        if _RULE.match(text):
            sections.append([])
        elif text.strip() and line[0] not in "╭╰":
            sections[-1].append(text)
    drawn = said.lstrip().startswith("╭")
    lines = sections[0] if drawn or len(sections) < 2 else sections[1]
    return [lines[0].strip(), *lines[1:]] if lines else []
