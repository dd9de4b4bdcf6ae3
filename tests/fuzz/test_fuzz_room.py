"""Broken, hostile and foreign files: every command line ends in success or in one sentence, and nothing that it finds makes it act.

`make test` carries out the cases below `QUICK`, `make test-all` those below `ALL` and all files that ever failed. Case 17 alone:
`python tests/fuzz/fuzz_worker.py 17`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fuzz_cases import LINES
from fuzz_regressions import regressions
from fuzz_room import changes, fault_of, tree
from fuzz_worker import Ending, Worker

from flexcal.cli.arguments.verb_table import VERBS, find_verb

QUICK = 300
ALL = 20_300
BATCH = 1000


@pytest.fixture(scope="module")
def workers() -> Iterator[list[Worker]]:
    with Worker() as one, Worker() as other:
        yield [one, other]


def faults(workers: Sequence[Worker], cases: Sequence[int | tuple[str, str, str]]) -> list[str]:
    """What is wrong with the cases, one text each; every worker takes its share."""

    def share(k: int) -> list[str | None]:
        return [workers[k].fault(case) for case in cases[k :: len(workers)]]

    with ThreadPoolExecutor(len(workers)) as threads:
        return [fault for found in threads.map(share, range(len(workers))) for fault in found if fault]


def test_every_verb_has_a_line() -> None:
    assert {verb.name for verb in VERBS} == {
        verb.name for line in LINES if (verb := find_verb(line.text.split()))
    }


@pytest.mark.parametrize(
    ("ending", "said"),
    [
        ({"status": 1}, "exit status 1"),
        ({"err": "Traceback (most recent call last)\nflexcal: a.csv: no.\n"}, "exit status 2"),
        ({"status": -11}, "signal 11"),
        ({"late": True}, "no end"),
        ({"status": 0, "err": "a.py:3: RuntimeWarning: overflow\n"}, "warning"),
        ({"err": "flexcal: a.csv: no.\nflexcal: a.csv: no.\n"}, "not one sentence"),
        ({"err": "flexcal: no.\n"}, "no file"),
        ({"err": "flexcal: a.csv: \x1b[31m.\n"}, "control characters"),
        ({"seconds": 11.0}, "11.0 s"),
        ({"megabytes": 900.0}, "900 MB"),
        ({"orphans": True}, "outlive"),
        ({}, None),
        ({"status": 0, "err": "reading …\n"}, None),
    ],
)
def test_the_property_can_fail(ending: dict[str, object], said: str | None) -> None:
    usual = {
        "status": 2,
        "late": False,
        "out": "",
        "err": "flexcal: a.csv: no.\n",
        "seconds": 0.1,
        "megabytes": 200.0,
    }
    fault = fault_of(Ending(**usual | ending), ["a.csv"])
    assert fault is None if said is None else fault is not None and said in fault


def test_changes_outside_are_seen(tmp_path: Path) -> None:
    (tmp_path / "work/new").mkdir(parents=True)
    for name in ("one", "two", "three"):
        (tmp_path / name).write_text(name)
    before = tree(tmp_path)
    (tmp_path / "one").write_text("eno")
    (tmp_path / "two").unlink()
    (tmp_path / "three").chmod(0o777)
    (tmp_path / "link").symlink_to("nothing")
    (tmp_path / "work/new/a.csv").touch()
    assert changes(before, tree(tmp_path), ["new", "new/*"]) == (
        ["link"],
        ["one", "three", "two"],
        ["work/new/a.csv"],
    )


def test_cases(workers: list[Worker]) -> None:
    found = faults(workers[:1], range(QUICK))
    assert not found, "\n\n".join(found)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(QUICK, ALL, BATCH))
def test_more_cases(first: int, workers: list[Worker]) -> None:
    found = faults(workers, range(first, first + BATCH))
    assert not found, "\n\n".join(found)


@pytest.mark.slow
def test_every_file_that_ever_failed(workers: list[Worker]) -> None:
    assert len(regressions()) > 90
    found = faults(workers, regressions())
    assert not found, "\n\n".join(found)
