"""Errors that tests expect: by their codes, whatever words the sentence has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from flexcal.errors import FlexcalError


@contextmanager
def refused(code: str, *names: str) -> Iterator[pytest.ExceptionInfo[FlexcalError]]:
    """A block that raises the error of this code, in one sentence that has these names and numbers, in this order."""
    with pytest.raises(FlexcalError) as caught:
        yield caught
    sentence = str(caught.value)
    assert caught.value.code == code, f"{caught.value.code}: {sentence}"
    assert "\n" not in sentence and sentence.endswith((".", "?")), sentence
    assert_named(sentence, *names)


def assert_named(sentence: str, *names: str) -> None:
    """Names (files, joints, numbers) stand in a sentence in this order, each by itself and not inside a longer word or number."""
    start = 0
    for name in names:
        found = re.compile(rf"(?<![\w-])(?<!\d\.){re.escape(name)}(?!\w|-\w|\.\d)").search(sentence, start)
        before = " after the names before it" if start else ""
        assert found is not None, f"'{name}' does not stand{before} in: {sentence}"
        start = found.end()


def assert_refusal(said: str, code: str, *names: str) -> None:
    """The last line on standard error is the error of this code, with these names and numbers, in this order."""
    line = said.rstrip("\n").rpartition("\n")[2]
    assert line.startswith("flexcal: ") and line.endswith(f" [{code}]"), said
    assert_named(line.removesuffix(f" [{code}]"), *names)
