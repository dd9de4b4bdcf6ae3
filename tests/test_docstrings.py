"""Docstrings of the library's face: NumPy's sections, the names of the signature, and examples that run."""

import doctest
import inspect
import re
from pathlib import Path

import pytest

import flexcal

FUNCTIONS = [name for name in flexcal.__all__ if not inspect.isclass(getattr(flexcal, name))]
CLASSES = [name for name in flexcal.__all__ if inspect.isclass(getattr(flexcal, name))]
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
WITHOUT_ERRORS = {"draw_truth", "gravity_torque"}
SECTION = re.compile(r"^(\w+)\n-+$", re.MULTILINE)


def docstring(name: str) -> str:
    return inspect.getdoc(getattr(flexcal, name)) or ""


def sections(text: str) -> dict[str, str]:
    """Text of every section by its title."""
    _, *parts = SECTION.split(text)
    return dict(zip(parts[::2], parts[1::2], strict=True))


def described(section: str) -> list[str]:
    """Names that a section describes, as in `left, right : ndarray`."""
    heads = re.findall(r"^(\w[\w, ]*?)(?: :.*)?$", section, re.MULTILINE)
    return [name.strip() for head in heads for name in head.split(",")]


def examples(name: str) -> list[doctest.DocTest]:
    tests = doctest.DocTestFinder(recurse=False).find(getattr(flexcal, name), name, globs={})
    return [test for test in tests if test.examples]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_returns_and_raises(name: str) -> None:
    function = getattr(flexcal, name)
    found, signature = sections(docstring(name)), inspect.signature(function)
    assert described(found.get("Parameters", "")) == list(signature.parameters)
    assert "Examples" in found
    assert ("Returns" in found) == (signature.return_annotation not in (None, "None"))
    assert ("Raises" in found) == (name not in WITHOUT_ERRORS)
    assert name in WITHOUT_ERRORS or re.match(r"\n?(Flexcal|Input)Error\n    \w", found["Raises"])


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_describes_its_fields(name: str) -> None:
    cls = getattr(flexcal, name)
    found = sections(docstring(name))
    assert not {"Parameters", "Attributes"} <= found.keys()
    names = described(found.get("Parameters", found.get("Attributes", "")))
    parameters = list(inspect.signature(cls).parameters)
    if name == "Estimator":
        assert names == ["name", "summary"]
    else:
        assert names == parameters


@pytest.mark.parametrize("name", CLASSES)
def test_a_method_says_what_it_takes(name: str) -> None:
    cls = getattr(flexcal, name)
    for key, value in vars(cls).items():
        function = getattr(value, "__func__", value)
        if key.startswith("_") or not inspect.isfunction(function) or key in INTERNAL:
            continue
        parameters = [k for k in inspect.signature(function).parameters if k not in ("self", "cls")]
        text = inspect.getdoc(function) or ""
        if text.startswith("As `"):  # the interface's docstring, which the class refers to
            continue
        assert described(sections(text).get("Parameters", "")) == parameters, f"{name}.{key}"
        assert (
            not parameters or "Returns" in sections(text) or "None" in str(function.__annotations__["return"])
        ), key


INTERNAL = {"write_arrays", "volume", "optimise"}
"""Methods that other packages call: in no example, and not for users."""


@pytest.mark.parametrize("name", [name for name in flexcal.__all__ if ">>>" in docstring(name)])
def test_examples_run(name: str, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(root)
    assert "+SKIP" not in docstring(name)
    report: list[str] = []
    runner = doctest.DocTestRunner(verbose=False, optionflags=OPTIONS)
    for test in examples(name):
        runner.run(test, out=report.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(report)
    assert runner.tries > 0
