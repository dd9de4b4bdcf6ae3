"""Finding verbs, help, exit statuses."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli_files import FLEXCAL
from refusals import assert_refusal

from flexcal.cli import main as cli
from flexcal.cli.arguments.verb_table import VERBS, command_class


def test_help_lists_every_verb_with_an_example(run) -> None:
    page = run("--help")
    assert page.status == 0 and page.err == ""
    for verb in VERBS:
        assert f"\n  {verb.name} " in page.out
        assert f"$ {verb.example}\n" in page.out
        assert verb.example.startswith(f"flexcal {verb.name} ")
    assert run().out == page.out


def test_steps_come_in_the_order_of_the_procedure(run) -> None:
    page = run("--help").out
    order = [
        "init",
        "import",
        "design frequency",
        "measure",
        "identify response",
        "identify stiffness",
        "design poses",
        "calibrate",
    ]
    order += ["verify", "export urdf"]
    places = [page.index(f"\n  {name} ") for name in order]
    assert places == sorted(places)


def test_help_imports_nothing_heavy() -> None:
    program = (
        "import sys\nfrom flexcal.cli.main import main\nmain(['--help'])\n"
        "print(*(n for n in ('numpy', 'tyro', 'rich', 'pinocchio', 'scipy') if n in sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.split() == []


def test_a_calibration_loads_what_it_needs(examples: Path, tmp_path: Path) -> None:
    """Neither half of SciPy, nor Plotly's objects, nor the parts of other verbs."""
    spared = (
        "scipy.optimize", "scipy.signal", "scipy.stats", "plotly.graph_objs", "flexcal.data.camera.board", "flexcal.dynamics",
        "flexcal.elasticity", "flexcal.fleet", "flexcal.frequency", "flexcal.jobs.fleet_prior.member", "flexcal.report.pages.study",
    )  # fmt: skip
    folder = examples / "ur5_tracker"
    program = (
        "import sys\nfrom flexcal.cli.main import main\n"
        f"main(['calibrate', {str(folder / 'robot.yaml')!r}, {str(folder / 'random.csv')!r}, '--out', {str(tmp_path / 'out')!r}])\n"
        f"print(*(name for name in {spared!r} if name in sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1].split() == []


def test_no_argument_needs_a_type_checker() -> None:
    program = (
        "import contextlib, io, sys\nfrom flexcal.cli.main import main\n"
        "from flexcal.cli.arguments.verb_table import VERBS\n"
        "for verb in VERBS:\n"
        "    with contextlib.redirect_stdout(io.StringIO()): main([*verb.words, '--help'])\n"
        "    assert 'typeguard' not in sys.modules, verb.name"
    )
    subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_every_verb_explains_itself(run, verb) -> None:
    page = run(*verb.words, "--help")
    assert page.status == 0
    assert verb.example in page.out and "--json" in page.out


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_every_example_parses(verb, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)

    command = command_class(verb)
    carried_out: list[object] = []
    monkeypatch.setattr(command, "run", lambda self: carried_out.append(self))
    assert cli.main(verb.example.split()[1:]) == 0
    assert len(carried_out) == 1


@pytest.mark.parametrize(
    ("wrong", "refusal"),
    [
        (["calibrat"], ["E-CLI-018", "flexcal calibrate"]),
        (["stiffness"], ["E-CLI-018", "flexcal identify stiffness"]),
        (["identify", "stifness"], ["E-CLI-041", "flexcal identify stiffness"]),
        (["identify"], ["E-CLI-040", "'flexcal identify response' or 'flexcal identify stiffness'"]),
        (["identfy", "response"], ["E-CLI-018", "flexcal identify response"]),
        (["export", "--out", "x"], ["E-CLI-040", "flexcal export urdf"]),
        (["validate"], ["E-CLI-018", "flexcal verify"]),
        (["qwxz"], ["E-CLI-018", "flexcal --help"]),
    ],
)
def test_wrong_verb_suggests_the_right_one(run, wrong: list[str], refusal: list[str]) -> None:
    outcome = run(*wrong)
    assert outcome.status == 2 and outcome.out == ""
    assert outcome.err.count("\n") == 1
    assert_refusal(outcome.err, *refusal)


def test_group_help_lists_its_verbs_only(run) -> None:
    page = run("design", "--help")
    assert page.status == 0
    assert "design poses" in page.out and "flexcal calibrate" not in page.out


def test_version(run) -> None:
    from flexcal import __version__

    assert run("--version").out == f"flexcal {__version__}\n"


@pytest.mark.parametrize("arguments", [["calibrate"], ["calibrate", "r.yaml", "p.csv", "--los", "cauchy"]])
def test_arguments_that_do_not_parse_exit_2_and_print_nothing(run, arguments: list[str]) -> None:
    outcome = run(*arguments)
    assert outcome.status == 2 and outcome.out == "" and outcome.err


def test_interrupt_exits_130(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: object) -> None:
        raise KeyboardInterrupt

    from flexcal.cli.verbs.verify import Verify

    monkeypatch.setattr(Verify, "run", interrupted)
    outcome = run("verify", "robot.yaml", "poses.csv")
    assert outcome.status == 130 and outcome.out == "" and "interrupted" in outcome.err


def test_interrupt_inside_an_import_exits_130(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """An extension module that is interrupted while it loads raises an ImportError from the KeyboardInterrupt."""

    def interrupted(self: object) -> None:
        raise ImportError("initialization failed") from KeyboardInterrupt()

    from flexcal.cli.verbs.verify import Verify

    monkeypatch.setattr(Verify, "run", interrupted)
    assert run("verify", "robot.yaml", "poses.csv").status == 130


def test_a_bug_keeps_its_traceback(run, monkeypatch: pytest.MonkeyPatch) -> None:
    from flexcal.cli.verbs.verify import Verify

    monkeypatch.setattr(Verify, "run", lambda self: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run("verify", "robot.yaml", "poses.csv")


def test_too_little_memory_is_said_in_a_sentence(run, monkeypatch: pytest.MonkeyPatch) -> None:
    from flexcal.cli.verbs.verify import Verify

    monkeypatch.setattr(Verify, "run", lambda self: np.empty(2**59))
    outcome = run("verify", "robot.yaml", "poses.csv")
    assert outcome.status == 2 and outcome.out == "" and outcome.err.count("\n") == 1
    assert_refusal(outcome.err, "E-CLI-016", "Unable to allocate")


def test_known_error_is_one_line_without_traceback(tmp_path: Path) -> None:
    done = subprocess.run(
        [FLEXCAL, "verify", tmp_path / "none.yaml", "poses.csv", "--json"], capture_output=True, text=True
    )
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("flexcal: ") and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["calibrate", "--help"], "Relative 1sigma of the ratio"),
        (["export", "urdf", "robot.yaml", "--out", "köln.urdf"], "wrote koln.urdf"),
        (["design", "frequency", "robot.yaml", "--out", "köln.yaml", "--json"], r'"plan": "k\u00f6ln.yaml"'),
        (["verify", "köln.csv", "o.csv"], "koln.csv is no robot.yaml"),
    ],
)
def test_terminal_with_ascii_only(arguments: list[str], words: str, tx90l_folder: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "LANG": "C", "PYTHONUTF8": "0"}
    done = subprocess.run([FLEXCAL, *arguments], cwd=tx90l_folder, env=environment, capture_output=True)
    shown = (done.stdout + done.stderr).decode("ascii")
    assert "Traceback" not in shown and "Error" not in shown
    assert words in " ".join(shown.split())


def test_reader_that_goes_away_is_no_error() -> None:
    done = subprocess.run(
        f"set -o pipefail; {FLEXCAL} --help | true", shell=True, executable="/bin/bash", capture_output=True
    )
    assert done.returncode == 0 and done.stderr == b""


def test_names_of_files_may_begin_with_dashes_behind_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for words in (["--", "--robot.yaml", "x.csv"], ["--terms", "kinematic", "--", "--robot.yaml", "x.csv"]):
        assert cli.main(["calibrate", *words]) == 2
        assert "--robot.yaml cannot be read" in capsys.readouterr().err
