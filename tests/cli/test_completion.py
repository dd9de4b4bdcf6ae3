"""Completion by the shells themselves, and one sentence for arguments that do not parse."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import get_type_hints

import pytest
from refusals import assert_refusal

from flexcal.cli.arguments.verb_options import options_of
from flexcal.cli.arguments.verb_table import VERBS, command_class

TRIED = {
    ("ca",): {"calibrate"},
    ("design", ""): {"trajectory", "frequency", "poses"},
    ("design", "poses", "--c"): {"--count", "--criterion", "--candidates"},
    ("calibrate", "robot.yaml", "poses.csv", "--loss", ""): {"auto", "squares", "huber", "cauchy"},
    ("completion", "z"): {"zsh"},
}


def test_bash_completes(run, tmp_path: Path) -> None:
    script = tmp_path / "flexcal.bash"
    assert run("completion", "bash", "--out", script).status == 0
    program = [f". {script}", "complete -p flexcal"]
    for words in TRIED:
        line = " ".join(f"'{word}'" for word in ("flexcal", *words))
        program.append(f'COMP_WORDS=({line}); COMP_CWORD={len(words)}; _flexcal; echo "${{COMPREPLY[*]}}"')
    done = subprocess.run(["bash", "-c", "\n".join(program)], capture_output=True, text=True, check=True)
    first, *found = done.stdout.splitlines()
    assert "-F _flexcal" in first and "default" in first, "file names otherwise"
    assert [set(line.split()) for line in found] == list(TRIED.values())


@pytest.mark.skipif(shutil.which("fish") is None, reason="fish is not installed")
def test_fish_completes(run, tmp_path: Path) -> None:
    script = tmp_path / "flexcal.fish"
    assert run("completion", "fish", "--out", script).status == 0
    for words, expected in TRIED.items():
        line = " ".join(["flexcal", *words])
        program = f"source {script}; complete -C '{line}'"
        done = subprocess.run(
            ["fish", "--no-config", "-c", program], capture_output=True, text=True, check=True
        )
        assert {found.split("\t")[0] for found in done.stdout.splitlines()} == expected


@pytest.mark.skipif(shutil.which("zsh") is None, reason="zsh is not installed")
def test_zsh_takes_the_script(run) -> None:
    script = (
        f"autoload -U compinit; compinit -u -D\n{run('completion', 'zsh').out}\nprint -r -- $_comps[flexcal]"
    )
    done = subprocess.run(["zsh", "-f", "-c", script], capture_output=True, text=True, check=True)
    assert "_flexcal" in done.stdout and done.stderr == ""


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_every_option_is_that_of_the_help(run, verb) -> None:
    page = run(*verb.words, "--help").out
    shown = {
        word.strip("[]|")
        for word in page.split("usage:")[1].split("\n\n")[0].split()
        if word.startswith("[--")
    }
    options = options_of(verb)
    assert "--json" in {option.name for option in options}
    for option in options:
        assert f"{option.name} " in page or f"{option.name}]" in page
    assert shown <= {option.name for option in options}
    kinds = get_type_hints(command_class(verb))
    counts = [option for option in options if kinds[option.field] in (int, int | None)]
    assert all(option.allowed is not None or option.name == "--port" for option in counts)


@pytest.mark.parametrize(
    ("arguments", "refusal"),
    [
        (["calibrate"], ["E-CLI-002", "calibrate", "ROBOT"]),
        (["calibrate", "r.yaml", "p.csv", "--los", "cauchy"], ["E-CLI-001", "--los; did you mean '--loss'"]),
        (["calibrate", "r.yaml", "p.csv", "--loss", "cauch"], ["E-CLI-004", "invalid choice 'cauch'"]),
        (["design", "poses", "r.yaml", "--count", "many"], ["E-CLI-004", "'many' is no whole number"]),
        (["design", "poses", "r.yaml", "--count"], ["E-CLI-004", "missing value for argument '--count'"]),
        (["calibrate", "r.yaml", "p.csv", "--secant-scale", "x"], ["E-CLI-004", "'x' is no number"]),
        (["export", "urdf", "robot.yaml"], ["E-CLI-002", "--out FILE"]),
        (["report", "a", "b"], ["E-CLI-003", "b"]),
        (["completion", "tcsh"], ["E-CLI-004", "'bash', 'zsh', 'fish'"]),
    ],
)
def test_arguments_that_do_not_parse_get_one_sentence(run, arguments: list[str], refusal: list[str]) -> None:
    outcome = run(*arguments)
    assert outcome.status == 2 and outcome.out == "" and outcome.err.startswith("flexcal: ")
    assert outcome.err.count("\n") == 1 and "─" not in outcome.err
    assert_refusal(outcome.err, *refusal)
