"""Faults of plain data: of one value, and of a document as sentences with their places."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple, cast

from flexcal.errors import FlexcalError
from flexcal.files.structuring.keys import Keys, dotted, file_key, known_keys
from flexcal.files.structuring.wording import suggestion
from flexcal.printable import excerpt

_MOST_SUGGESTIONS = 100
"""Unknown keys of one mapping above which no similar ones are looked for."""


class Failure(NamedTuple):
    """Invalid value: code and sentence as of `FlexcalError`, and the keys that lead to the value."""

    code: str
    keys: Keys
    sentence: str


class StructureError(FlexcalError):
    """Data that does not fit a class: all that does not; the first is the error's own code and sentence."""

    def __init__(self, failures: list[Failure]):
        super().__init__(failures[0].code, failures[0].sentence)
        self.failures = failures

    def __reduce__(self) -> tuple[type[StructureError], tuple[list[Failure]]]:
        return StructureError, (self.failures,)


class Fault(ValueError):
    """A value that does not fit its field: a code, and a sentence without place."""

    def __init__(self, code: str, sentence: str):
        super().__init__(code, sentence)
        self.code = code
        self.sentence = sentence

    def __str__(self) -> str:
        return self.sentence


class Nested(Exception):
    """A failure inside an item of a mapping or a tuple of fixed length."""

    def __init__(self, key: str | int, cause: BaseException):
        super().__init__(str(cause))
        self.key = key
        self.cause = cause


def failures(problem: BaseException, keys: Keys) -> list[Failure | None]:
    """All failures in an exception of cattrs; None for one not the data's fault."""
    from cattrs.errors import (
        AttributeValidationNote,
        ClassValidationError,
        ForbiddenExtraKeysError,
        IterableValidationNote,
    )

    if isinstance(problem, Nested):
        return failures(problem.cause, (*keys, problem.key))
    if isinstance(problem, ForbiddenExtraKeysError):
        known, suggest = known_keys(problem.cl), len(problem.extra_fields) <= _MOST_SUGGESTIONS
        return [
            Failure("E-YAML-001", (*keys, key), _unknown_key(key, keys, known, suggest=suggest))
            for key in problem.extra_fields
        ]
    if isinstance(problem, BaseExceptionGroup):
        faults: list[Failure | None] = []
        misspelt = any(isinstance(inner, ForbiddenExtraKeysError) for inner in problem.exceptions)
        for inner in problem.exceptions:
            place = keys
            for note in getattr(inner, "__notes__", ()):
                if isinstance(note, AttributeValidationNote):
                    place = (*keys, _key_of(problem, note.name))
                elif isinstance(note, IterableValidationNote):
                    place = (*keys, cast("str | int", note.index))
            if isinstance(inner, KeyError) and isinstance(problem, ClassValidationError) and place != keys:
                name = str(place[-1])
                if misspelt:  # the unknown key, named by its own failure, is probably this one
                    continue
                faults.append(
                    Failure(
                        "E-YAML-002", keys, f"the key '{name}'{_inside(keys)} is missing; add '{name}: …'."
                    )
                )
            else:
                faults.extend(failures(inner, place))
        return faults
    if isinstance(problem, (Fault, FlexcalError)):
        return [Failure(problem.code, keys, _placed(keys, problem))]
    if isinstance(problem, (ValueError, TypeError)):
        return [Failure("E-YAML-003", keys, _placed(keys, problem))]
    return [None]


def _placed(keys: Keys, problem: Exception) -> str:
    subject = f"{dotted(keys)}: " if keys else ""
    sentence = str(problem)
    return subject + sentence + ("" if sentence.endswith((".", "?")) else ".")


def _key_of(problem: BaseExceptionGroup, name: str) -> str:
    """The key in the file of the attribute `name` of the class that `problem` is about."""
    cls = getattr(problem, "cl", None)
    fields = dataclasses.fields(cls) if cls is not None and dataclasses.is_dataclass(cls) else ()
    return next((file_key(field) for field in fields if field.name == name), name)


def _unknown_key(key: str, keys: Keys, known: list[str], *, suggest: bool) -> str:
    near = suggestion(key, known) if suggest else ""
    hint = near or f"; known are {', '.join(known)}."
    return f"unknown key '{excerpt(key)}'{_inside(keys)}{hint}"


def _inside(keys: Keys) -> str:
    return f" in {dotted(keys)}" if keys else ""
