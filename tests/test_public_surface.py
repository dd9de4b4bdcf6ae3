"""Faces of the packages: every name resolves, nobody imports past them, and the light import stays light."""

import ast
import importlib
import pkgutil
import subprocess
import sys
from inspect import isclass, isroutine
from pathlib import Path

import pytest

import flexcal

PACKAGES = sorted(
    module.name for module in pkgutil.walk_packages(flexcal.__path__, "flexcal.") if module.ispkg
)
HEAVY = ("casadi", "cvxpy", "mujoco", "plotly", "polars", "scipy.optimize", "scipy.signal")


@pytest.mark.parametrize("name", ["flexcal", *PACKAGES])
def test_every_public_name_resolves(name: str) -> None:
    module = importlib.import_module(name)
    public = getattr(module, "__all__", ())
    assert len(public) == len(set(public)), f"{name}.__all__ lists a name twice"
    assert [item for item in public if not hasattr(module, item)] == []


@pytest.mark.parametrize("name", ["flexcal", *PACKAGES])
def test_no_module_stands_before_a_public_name_that_is_imported_late(name: str) -> None:
    package = importlib.import_module(name)
    modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
    assert modules.isdisjoint(getattr(package, "__all__", ()))


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_object_has_a_docstring(name: str) -> None:
    module = importlib.import_module(name)
    objects = {item: getattr(module, item) for item in getattr(module, "__all__", ())}
    assert module.__doc__, f"{name} says nowhere what it is"
    written = {item: value for item, value in objects.items() if isclass(value) or isroutine(value)}
    assert [item for item, value in written.items() if not (value.__doc__ or "").strip()] == []


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError):
        flexcal.no_such_name  # noqa: B018


def test_robot_model_does_not_import_what_is_heavy() -> None:
    program = f"import sys\nfrom flexcal import RobotModel\nprint(*(name for name in {HEAVY!r} if name in sys.modules))"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []


def test_no_import_past_the_face_of_another_package() -> None:
    """`cli` has no faces: its start-up is counted in milliseconds."""
    root = Path(flexcal.__file__).parent
    past = []
    for file in sorted(root.rglob("*.py")):
        own = ("flexcal", *file.relative_to(root).parent.parts)
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("flexcal."):
                continue
            parts = tuple(str(node.module).split("."))
            is_module = (root.joinpath(*parts[1:-1]) / f"{parts[-1]}.py").is_file()
            if is_module and len(parts) > 2 and parts[:-1] != own and parts[1] != "cli":
                past.append(f"{file.relative_to(root)} imports {node.module}")
    assert past == []
