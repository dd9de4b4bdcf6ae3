"""The options of a verb, from its dataclass, for completion and error messages."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from tyro.conf import Positional

from flexcal.cli.arguments.shared_options import Between
from flexcal.cli.arguments.verb_table import Verb, command_class
from flexcal.errors import InputError

_DIGITS = 20
"""Largest number of digits that a message quotes."""


@dataclass(frozen=True)
class Option:
    """`--name` of a `field`; `flag` where it takes no value, `choices` where it takes one of few, `allowed` where a number in a range."""

    name: str
    field: str
    flag: bool
    choices: tuple[str, ...]
    allowed: Between | None


def check_ranges(verb: Verb, parsed: Any) -> None:
    """Raise `InputError` for the first option whose number is not in its range."""
    for option in options_of(verb):
        value = getattr(parsed, option.field)
        if option.allowed is not None and value is not None and not option.allowed.includes(value):
            shown = str(value) if len(str(value)) <= _DIGITS else f"{str(value)[:_DIGITS]}…"
            raise InputError("E-CLI-008", f"{option.name} is {shown}; give {option.allowed}.")


@cache
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
        allowed = next((note for note in notes if isinstance(note, Between)), None)
        name = f"--{named or field.name.replace('_', '-')}"
        options.append(Option(name, field.name, kind is bool, choices, allowed))
    return tuple(options)
