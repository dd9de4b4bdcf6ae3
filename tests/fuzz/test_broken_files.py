"""Broken files: every one ends in success or in one sentence that names a file; never in a traceback, a crash, a hang, or an escape
sequence on the terminal.

`make test-all` runs every case that ever failed and every `STRIDE`-th of all generated ones, `make test` a few of both.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from fuzz_cases import SUBJECTS, Case, cases, names_of
from fuzz_process import FlexcalProcesses
from fuzz_regressions import REGRESSIONS, regressions
from fuzz_seeds import run_verbs, write_files
from fuzz_special import KINDS, ended

STRIDE = 20
QUICK = 1000
BATCHES = 12


@pytest.fixture(scope="module")
def flexcal() -> Iterator[FlexcalProcesses]:
    with FlexcalProcesses() as processes:
        yield processes


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The arm's own files."""
    folder = tmp_path_factory.mktemp("files")
    write_files(folder)
    return folder


@pytest.fixture(scope="module")
def all_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Those, and what verbs made of them."""
    folder = tmp_path_factory.mktemp("all_files")
    write_files(folder)
    run_verbs(folder)
    return folder


def faults(flexcal: FlexcalProcesses, chosen: list[Case], seeds: Path, folder: Path) -> list[str]:
    """What is wrong with the endings of some cases, one text a case."""
    found = []
    for case in chosen:
        case.lay_out(seeds, folder / "case")
        fault = flexcal.run(case.arguments, folder / "case").fault(names_of(case))
        if fault:
            found.append(f"{case.name}: flexcal {' '.join(case.arguments)}\n{fault}")
        shutil.rmtree(folder / "case")
    return found


def test_the_arm_is_valid(flexcal: FlexcalProcesses, files: Path, tmp_path: Path) -> None:
    """Else every case would end well."""
    for words in (
        "export urdf robot.yaml --out new.urdf",
        "design poses robot.yaml --count 6 --candidates 30 --out new.yaml",
    ):
        shutil.copytree(files, tmp_path / "case")
        ending = flexcal.run(words.split(), tmp_path / "case")
        assert ending.status == 0 and ending.fault([]) is None, ending
        shutil.rmtree(tmp_path / "case")


def test_a_few_broken_files(flexcal: FlexcalProcesses, files: Path, tmp_path: Path) -> None:
    generated, kept = list(cases(files)), list(regressions(files))
    chosen = (
        generated[::QUICK] + [case for case in kept if case.arguments[0] in ("export", "init", "import")][::3]
    )
    assert len(chosen) >= 15
    found = faults(flexcal, chosen, files, tmp_path)
    assert not found, "\n\n".join(found)


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("robot.yaml", "export urdf robot.yaml --out new.urdf"),
        ("arm.urdf", "export urdf robot.yaml --out new.urdf"),
        ("poses.csv", "calibrate robot.yaml poses.csv --out new"),
        ("foreign.txt", "import robot.yaml foreign.txt --out new.csv"),
        ("bag/bag.mcap", "import robot.yaml bag --out new.csv"),
    ],
)
def test_a_pipe_is_no_file(
    file: str, line: str, flexcal: FlexcalProcesses, files: Path, tmp_path: Path
) -> None:
    """Nothing waits for what may come out of it; a reader each."""
    shutil.copytree(files, tmp_path / "files")
    (tmp_path / "files/bag").mkdir()
    (tmp_path / "files/bag/metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (tmp_path / "files/bag/bag.mcap").touch()
    ending, fault = ended(flexcal, "pipe", file, line, tmp_path / "files", tmp_path / "case")
    assert fault is None and f"{file} is a pipe, not a file" in ending.err, (fault, ending)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_file(kind: str, flexcal: FlexcalProcesses, all_files: Path, tmp_path: Path) -> None:
    """No verb waits for a pipe, reads a device without end, or stumbles over a folder."""
    there = [subject for subject in SUBJECTS if (all_files / subject.file).is_file()]
    found = [
        ended(flexcal, kind, subject.file, line, all_files, tmp_path / "case")[1]
        for subject in there
        for line in subject.lines
    ]
    assert len(found) > 60
    assert not any(found), "\n\n".join(filter(None, found))


@pytest.mark.slow
def test_every_file_that_ever_failed(flexcal: FlexcalProcesses, all_files: Path, tmp_path: Path) -> None:
    chosen = list(regressions(all_files))
    assert len(chosen) == len(REGRESSIONS)
    found = faults(flexcal, chosen, all_files, tmp_path)
    assert not found, "\n\n".join(found)


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(BATCHES))
def test_broken_files(batch: int, flexcal: FlexcalProcesses, all_files: Path, tmp_path: Path) -> None:
    everything = list(cases(all_files))
    assert len(everything) > 15_000
    chosen = everything[::STRIDE][batch::BATCHES]
    assert len(chosen) * BATCHES > 900
    found = faults(flexcal, chosen, all_files, tmp_path)
    assert not found, "\n\n".join(found)
