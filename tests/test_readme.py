"""Every line of the README works: its targets, its verbs, its command lines, its Python."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|python)\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
SHELL = [text for language, text in BLOCKS if language == "sh"]
PYTHON = [text for language, text in BLOCKS if language == "python"]
LINES = [line for text in SHELL for line in text.splitlines()]
VERBS = sorted(set(re.findall(r"^\| `flexcal ([a-z ]+)`", README, flags=re.MULTILINE)))
SCRIPTS = [text for text in SHELL if "\nflexcal" in f"\n{text}"]
BIN = Path(sys.executable).parent


def workplace(tmp_path: Path, root: Path) -> dict[str, str]:
    """Put the examples under `tmp_path`, so that a README line can write; the environment finds `flexcal`."""
    shutil.copytree(root / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("estimates.*"))
    return {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}


def run(command: list[str], tmp_path: Path, environment: dict[str, str]) -> None:
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, f"{command}\n{result.stdout}\n{result.stderr}"


def test_readme_has_something_to_run() -> None:
    assert SCRIPTS and PYTHON and VERBS


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("make ")])
def test_make_target_exists(line: str, root: Path) -> None:
    run(["make", "--dry-run", *shlex.split(line, comments=True)[1:]], root, dict(os.environ))


@pytest.mark.parametrize("verb", VERBS)
def test_verb_exists(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    from flexcal.cli.main import main

    assert main([*verb.split(), "--help"]) == 0
    assert f"flexcal {verb}" in capsys.readouterr().out


def test_every_verb_is_listed() -> None:
    """Each export in the page on exporting."""
    from flexcal.cli.arguments.verb_table import EXPORTS
    from flexcal.cli.arguments.verb_table import VERBS as KNOWN

    assert sorted({*(verb.name for verb in KNOWN if verb not in EXPORTS), "export"}) == VERBS


@pytest.mark.parametrize("script", [text for text in SCRIPTS if "flexcal demo" not in text])
def test_command_lines_run(script: str, tmp_path: Path, root: Path) -> None:
    run(["bash", "-euc", script], tmp_path, workplace(tmp_path, root))


@pytest.mark.slow
@pytest.mark.parametrize("script", [text for text in SCRIPTS if "flexcal demo" in text])
def test_demo_command_lines_run(script: str, tmp_path: Path, root: Path) -> None:
    run(["bash", "-euc", script], tmp_path, workplace(tmp_path, root))


@pytest.mark.parametrize("program", PYTHON)
def test_python_runs(program: str, tmp_path: Path, root: Path) -> None:
    run([sys.executable, "-c", program], tmp_path, workplace(tmp_path, root))


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\]\(([^)#:]+)\)", README))))
def test_links_lead_somewhere(target: str, root: Path) -> None:
    assert (root / target).exists()
