"""Every error has a code of its own, which it keeps wherever it goes."""

from __future__ import annotations

import ast
import pickle
import re
import runpy
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from flexcal.calibration.measurement import OneFlank
from flexcal.data.recordings.low_pass import TooFewSamples
from flexcal.errors import FlexcalError, InputError, naming, unreadable
from flexcal.files.structuring.faults import Failure, Fault, StructureError

CODE = re.compile(r"E-([A-Z]+)-(\d{3})")
CLASSES = {
    "FlexcalError",
    "InputError",
    "AmbiguousArm",
    "NotFinite",
    "OneFlank",
    "ReadingGoesOn",
    "TooFewSamples",
    "Fault",
    "Failure",
}


@pytest.fixture(scope="module")
def nodes(root: Path) -> dict[str, list[ast.AST]]:
    """All nodes of every file of the source."""
    files = sorted((root / "src" / "flexcal").rglob("*.py"))
    return {str(file): list(ast.walk(ast.parse(file.read_text(encoding="utf-8")))) for file in files}


@pytest.fixture(scope="module")
def page(root: Path) -> str:
    return (root / "docs" / "errors.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def script(root: Path) -> dict[str, Any]:
    return runpy.run_path(str(root / "docs" / "error_codes.py"))


@pytest.fixture(scope="module")
def errors(script: dict[str, Any]) -> list[tuple[str, str]]:
    """Code and sentence of every error, as the script reads them from the source."""
    return list(script["errors"]())


def name_of(called: ast.expr) -> str:
    return (
        called.attr
        if isinstance(called, ast.Attribute)
        else called.id
        if isinstance(called, ast.Name)
        else ""
    )


def test_the_classes_are_all(nodes: dict[str, list[ast.AST]]) -> None:
    """Those that derive from `FlexcalError`; of a `StructureError` the first failure has the code."""
    known = {"FlexcalError"}
    classes = [node for those in nodes.values() for node in those if isinstance(node, ast.ClassDef)]
    for _ in range(3):
        known |= {node.name for node in classes if known & {name_of(base) for base in node.bases}}
    assert known == CLASSES - {"Fault", "Failure"} | {"StructureError"}


def test_every_error_has_a_code(nodes: dict[str, list[ast.AST]]) -> None:
    """A literal, the code of the error in whose place it is raised, or, in a function that makes errors, what that was given."""
    makers, calls = set(CLASSES), []
    for file, those in nodes.items():
        for node in those:
            if (
                isinstance(node, ast.FunctionDef)
                and node.returns is not None
                and ast.unparse(node.returns) in CLASSES
            ):
                given = [argument.arg for argument in node.args.args if argument.arg != "self"]
                if given[:1] == ["code"]:
                    makers.add(node.name)
            raised = node.exc if isinstance(node, ast.Raise) else node
            if isinstance(raised, ast.Call):
                calls.append((file, raised, raised is not node))
    assert makers - CLASSES == {"error", "_error", "wrong"}
    checked = 0
    for file, call, raised in calls:
        if name_of(call.func) in CLASSES or (raised and name_of(call.func) in makers):
            code = call.args[0] if call.args else None
            literal = isinstance(code, ast.Constant) and CODE.fullmatch(str(code.value))
            assert literal or (code is not None and name_of(code) == "code"), f"{file}:{call.lineno}"
            checked += bool(literal)
    assert checked > 750


def test_no_code_stands_twice(nodes: dict[str, list[ast.AST]], errors: list[tuple[str, str]]) -> None:
    literals = Counter(
        node.value
        for those in nodes.values()
        for node in those
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value)
    )
    assert [code for code, count in literals.items() if count > 1] == []
    assert set(literals) == {code for code, _ in errors}


def test_the_page_has_every_code(page: str, script: dict[str, Any], errors: list[tuple[str, str]]) -> None:
    """If this fails, run docs/error_codes.py."""
    sentences = dict(errors)
    assert page == script["render"](page, sentences)
    assert all(sentence.strip(" …") for sentence in sentences.values())
    listed = re.findall(r"^\| `(E-[A-Z]+-\d{3})` \| .+ \|$", page, flags=re.MULTILINE)
    gone = script["retired"](page, set(sentences))
    assert sorted(listed) == sorted(sentences)
    assert {match[0] for match in CODE.finditer(page)} == {*listed, *gone}
    for subject, count in Counter(CODE.fullmatch(code)[1] for code in (*listed, *gone)).items():  # type: ignore[index]
        assert f"E-{subject}-{count:03d}" in {*listed, *gone}, f"numbers of {subject} are left out"


def test_a_code_that_is_gone_stays_on_the_page(
    page: str, script: dict[str, Any], errors: list[tuple[str, str]]
) -> None:
    sentences = dict(errors)
    in_use = page.partition("## No longer in use")[0]
    later = script["render"](in_use + "| `E-CAL-900` | the loop was open. |\n", sentences)
    assert later.startswith(in_use.rstrip()) and later.endswith("## No longer in use\n\n`E-CAL-900`\n")
    assert script["render"](later, sentences) == later


@pytest.mark.parametrize("kind", [FlexcalError, InputError, OneFlank, TooFewSamples])
def test_an_error_is_its_sentence(kind: type[FlexcalError]) -> None:
    problem = kind("E-CAL-900", "the loop was open; close it.")
    assert str(problem) == problem.sentence == "the loop was open; close it." and problem.code == "E-CAL-900"
    again = pickle.loads(pickle.dumps(problem))
    assert type(again) is kind and (again.code, str(again)) == (problem.code, str(problem))


def test_a_structure_error_has_the_code_of_its_first_failure() -> None:
    failures = [Failure("E-CAL-900", ("a", 1), "one."), Failure("E-CAL-901", (), "two.")]
    again = pickle.loads(pickle.dumps(StructureError(failures)))
    assert type(again) is StructureError and again.failures == failures
    assert (again.code, str(again)) == ("E-CAL-900", "one.")
    fault = Fault("E-CAL-900", "no number")
    assert (fault.code, str(fault)) == ("E-CAL-900", "no number")


def test_another_process_keeps_the_code(tmp_path: Path) -> None:
    from joblib import Parallel, delayed

    with pytest.raises(InputError) as caught:
        Parallel(n_jobs=2)(delayed(refuse)(str(tmp_path / name)) for name in "ab")
    assert caught.value.code == "E-CAL-900" and str(tmp_path) in str(caught.value)


def refuse(name: str) -> None:
    raise InputError("E-CAL-900", f"{name} is no loop; close it.")


def test_an_error_that_is_placed_keeps_its_code() -> None:
    with pytest.raises(InputError) as caught, naming(Path("a.csv")):
        raise FlexcalError("E-CAL-900", "the loop was open.")
    assert (caught.value.code, str(caught.value)) == ("E-CAL-900", "a.csv: the loop was open.")
    refusal = InputError("E-CAL-901", "b.csv line 3: no number.")
    with pytest.raises(InputError) as caught, naming(Path("a.csv")):
        raise refusal
    assert caught.value is refusal


def test_what_cannot_be_read_has_the_systems_reason() -> None:
    problem = unreadable(Path("a.csv"), FileNotFoundError(2, "No such file or directory"))
    assert problem.code == "E-FILE-001" and "No such file or directory" in str(problem)
