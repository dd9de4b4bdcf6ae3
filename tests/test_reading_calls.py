"""Files are opened to be read in one place, which waits for no pipe and loads nothing without a bound."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import flexcal

SOURCE = Path(flexcal.__file__).parent
OWN = ("files/transaction/", "cli/folders/", "export/xacro_expansion.py")
"""Where the one place is, and what it is made of."""
PACKAGE = ("__file__", "os.devnull", ".css", "np.load(stream", "(folder / name)")
"""Marks of calls that open files of the package, no file at all, or a stream that is open."""


def own_readings(path: Path) -> Iterator[str]:
    """Calls of a module that open a file to be read by other means."""
    for call in ast.walk(ast.parse(path.read_text("utf-8"))):
        text = ast.unparse(call) if isinstance(call, ast.Call) else ""
        if not isinstance(call, ast.Call) or any(mark in text for mark in PACKAGE):
            continue
        name = ast.unparse(call.func)
        mode = call.args[0].value if call.args and isinstance(call.args[0], ast.Constant) else None
        if (
            name in ("open", "io.open", "np.load", "np.loadtxt", "np.genfromtxt")
            or name.endswith((".read_text", ".read_bytes"))
            or (name == "os.open" and "O_CREAT" not in text)
            or (name.endswith(".open") and isinstance(mode, str) and not set("wax") & set(mode))
        ):
            yield f"{path.relative_to(SOURCE)} line {call.lineno}: {text}"


def test_no_file_is_opened_to_be_read_by_other_means() -> None:
    modules = [path for path in SOURCE.rglob("*.py") if not str(path.relative_to(SOURCE)).startswith(OWN)]
    assert [found for path in modules for found in own_readings(path)] == []
