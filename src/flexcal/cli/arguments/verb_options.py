"""The options of a verb, from its dataclass, for completion and error messages."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Literal, get_args, get_origin, get_type_hints

from tyro.conf import Positional

from flexcal.cli.arguments.verb_table import Verb, command_class


@dataclass(frozen=True)
class Option:
    """`--name`; `flag` where it takes no value, `choices` where it takes one of few."""

    name: str
    flag: bool
    choices: tuple[str, ...]


def options_of(verb: Verb) -> tuple[Option, ...]:
    """The options of a verb in the order of its help; those without a name in front are none."""
    command = command_class(verb)
    hints = get_type_hints(command, include_extras=True)
    options = []
    for field in fields(command):
        kind, notes = hints[field.name], ()
        if get_origin(kind) is Annotated:
            kind, *notes = get_args(kind)
        if any(note is Positional for note in notes):
            continue
        named = next((note.name for note in notes if getattr(note, "name", None)), None)
        choices = tuple(map(str, get_args(kind))) if get_origin(kind) is Literal else ()
        options.append(Option(f"--{named or field.name.replace('_', '-')}", kind is bool, choices))
    return tuple(options)
