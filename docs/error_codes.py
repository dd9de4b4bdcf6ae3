"""Writes errors.md: every error's code and sentence, from the source. Run it where an error was added, or says something else.

A code that is no longer in the source stays on the page, so that no other error takes it.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE / "errors.md"
SOURCE = HERE.parent / "src" / "flexcal"
CODE = re.compile(r"E-([A-Z]+)-(\d{3})")
SUBJECTS = {
    "CAL": "Geometry: calibration and verification",
    "CELL": "Virtual cell",
    "CLI": "Command line",
    "COMP": "Compensation",
    "DESIGN": "Design of experiments",
    "DYN": "Dynamics",
    "EST": "Files of estimates",
    "EXP": "Folders of experiments",
    "EXPORT": "Export",
    "FILE": "Files",
    "FIT": "Least squares",
    "FLEET": "Fleets",
    "FRF": "Frequency responses",
    "IMPORT": "Import of measurements",
    "LOG": "Recordings",
    "MODEL": "Robot model",
    "PLAN": "Plans",
    "POSES": "Poses",
    "PRIOR": "Prior of a robot model",
    "PROG": "Robot programs",
    "RECHECK": "Recheck of a calibration",
    "REPORT": "Reports",
    "ROBOT": "robot.yaml",
    "ROS": "Descriptions of ROS",
    "RUN": "Verbs and what they are given",
    "SERVE": "Server",
    "STIFF": "Stiffness",
    "STUDIO": "Studio",
    "STUDY": "Studies",
    "TABLE": "Tables",
    "TOOL": "Tool and work object",
    "URDF": "URDF",
    "WORK": "Worker processes and clusters",
    "YAML": "YAML",
}
HEAD = """# Errors

The command line prints an error's code after its sentence; a `FlexcalError` has it as its attribute `code`. A code names one sentence and
is never given to another. What differs from case to case is in italics or left out (…); the file and the line stand before many of these
sentences.
"""
_MARKUP = re.compile(r"([\\*_|<>\[\]{}$#])")


def errors() -> Iterator[tuple[str, str]]:
    """Code and sentence of every error in the source, in Markdown."""
    for file in sorted(SOURCE.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if not CODE.search(text):
            continue
        nodes = list(ast.walk(ast.parse(text)))
        functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
        for call in nodes:
            if isinstance(call, ast.Call) and (code := _code(call)):
                around = [node for node in functions if node.lineno <= call.lineno <= (node.end_lineno or 0)]
                innermost = max(around, key=lambda node: node.lineno, default=None)
                sentences = _Sentences({node.name: node for node in functions}, innermost).of(call.args[-1])
                yield code, " / ".join(dict.fromkeys(sentences))


def _code(call: ast.Call) -> str | None:
    """The code among the arguments of a call."""
    for argument in call.args:
        if isinstance(argument, ast.Constant) and CODE.fullmatch(str(argument.value)):
            return str(argument.value)
    return None


@dataclass(frozen=True)
class _Sentences:
    """What an argument can say, as far as that stands in the same file: in the function around it, or in one that is called there."""

    functions: Mapping[str, ast.FunctionDef]
    around: ast.FunctionDef | None

    def of(self, node: ast.expr | None) -> list[str]:
        if isinstance(node, ast.Constant):
            return [_escaped(str(node.value))]
        if isinstance(node, ast.JoinedStr):
            return [_joined(node)]
        if isinstance(node, ast.IfExp):
            return [*self.of(node.body), *self.of(node.orelse)]
        if isinstance(node, ast.BinOp):
            return [left + right for left in self.of(node.left) for right in self.of(node.right)]
        if isinstance(node, ast.Name) and self.around is not None:
            assigned = [
                sentence
                for statement in ast.walk(self.around)
                if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == node.id
                for sentence in self.of(statement.value)
            ]
            return assigned or ["…"]
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
            function = self.functions.get(name)
            if function is not None and function is not self.around:
                inside = _Sentences(self.functions, function)
                returns = [each.value for each in ast.walk(function) if isinstance(each, ast.Return)]
                return [sentence for value in returns for sentence in inside.of(value)]
        return ["…"]


def _joined(node: ast.JoinedStr) -> str:
    pieces, code = [], False
    for value in node.values:
        if isinstance(value, ast.FormattedValue):
            pieces.append("…" if code else _placeholder(value.value))
        else:
            text = str(ast.literal_eval(value))
            pieces.append(_escaped(text, code))
            code ^= text.count("`") % 2 == 1
    return "".join(pieces)


def _placeholder(value: ast.expr) -> str:
    """The name of what is inserted, in italics."""
    if isinstance(value, ast.Attribute):
        name = value.attr
    elif isinstance(value, ast.Name):
        name = value.id
    else:
        return "…"
    return f"*{name.strip('_').replace('_', ' ')}*"


def _escaped(text: str, code: bool = False) -> str:
    """Text in which only backquotes are markup; `code` where it begins between two of them."""
    pieces = text.split("`")
    return "`".join(
        piece if (k % 2 == 1) != code else _MARKUP.sub(r"\\\1", piece) for k, piece in enumerate(pieces)
    )


def retired(page: str, known: set[str]) -> list[str]:
    """Codes of a page that the source no longer has."""
    return sorted({match[0] for match in CODE.finditer(page)} - known)


def render(page: str, sentences: Mapping[str, str]) -> str:
    """The page of these sentences by code; `page` is that of before."""
    subjects: dict[str, list[str]] = defaultdict(list)
    for code in sorted(sentences):
        subjects[CODE.fullmatch(code)[1]].append(f"| `{code}` | {sentences[code]} |")  # type: ignore[index]
    sections = [
        "\n".join([f"## {SUBJECTS[subject]}", "", "| code | sentence |", "| --- | --- |", *subjects[subject]])
        for subject in sorted(subjects)
    ]
    gone = retired(page, set(sentences))
    if gone:
        sections.append("## No longer in use\n\n" + ", ".join(f"`{code}`" for code in gone))
    return "\n\n".join([HEAD.rstrip(), *sections]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(render(PAGE.read_text(encoding="utf-8"), dict(errors())), encoding="utf-8")
