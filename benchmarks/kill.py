"""Verbs that are killed at random moments: the files are of the run before or of the new one, and the next run works.

`python -m benchmarks.kill [--count 40] [--cases calibrate identify demo] [--signals KILL TERM INT HUP] [--seed 0]`

Half of the moments are uniform over the run, half after its first file, while others are written. Before and after a kill, every file is
compared by SHA-256 with the runs that it can be of; then the folder is opened as any verb does, and compared again.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np

from flexcal.cli.main import main as flexcal
from flexcal.files.transaction import recover

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
LEDGER, STAGES = ".flexcal", ".flexcal-run-*"
_SAID = "said.txt"
_IMPORTED = ("calibration.job", "dynamics.job", "two_stage.job")
"""Modules of `flexcal.jobs`."""
_RERUNS = {"demo": 8}
"""Of so many kills of a verb one is followed by a run to its end; of the others, by the one that is killed next."""


@dataclass(frozen=True)
class Case:
    """A verb, in a copy of a robot's folder: the command lines of the run before and of the one that is killed, which write into `out`."""

    name: str
    robot: Path
    before: tuple[str, ...]
    killed: tuple[str, ...]
    out: str
    steady: tuple[str, ...]
    """Files that are the same whenever a command line is run again, as no duration stands in them."""


CASES = (
    Case(
        "calibrate",
        EXAMPLES / "ur5_tracker",
        ("calibrate", "robot.yaml", "random.csv", "--terms", "kinematic", "--out", "out"),
        ("calibrate", "robot.yaml", "random.csv", "--terms", "kinematic", "--loss", "cauchy", "--out", "out"),
        "out",
        ("estimates.npz", "points.csv", "arm.npz"),
    ),
    Case(
        "identify",
        EXAMPLES / "tx40",
        ("identify", "dynamics", "robot.yaml", "exciting.parquet", "--estimator", "ols", "--out", "out"),
        ("identify", "dynamics", "robot.yaml", "exciting.parquet", "--estimator", "wls", "--out", "out"),
        "out",
        ("estimates.npz", "predictions.npz"),
    ),
    Case(
        "demo",
        HERE / "small_robot",
        ("demo", "--robot", "robot.yaml", "--seed", "1", "--out", "out"),
        ("demo", "--robot", "robot.yaml", "--seed", "2", "--out", "out"),
        "out",
        ("truth.yaml", "estimates.npz", "points.csv", "verification.csv", "calibrated.urdf"),
    ),
)


def run(count: int = 40) -> list[tuple[str, float, str]]:
    """Share of the kills after which all was well."""
    rows = []
    for case in CASES:
        for name in ("KILL", "TERM"):
            found = killed_runs(case, getattr(signal, f"SIG{name}"), count, np.random.default_rng(0))
            good = count - found["torn"] - found["no rerun"]
            rows.append((f"{case.name}, SIG{name}", good / count, _told(found)))
    return rows


def killed_runs(case: Case, number: int, count: int, rng: np.random.Generator) -> Counter[str]:
    """How often each of these was found: old, new, finished (of both, and new once opened), torn, no rerun."""
    found: Counter[str] = Counter()
    for module in _IMPORTED:
        import_module(f"flexcal.jobs.{module}")
    with tempfile.TemporaryDirectory(prefix="kill_") as place:
        folder = Path(shutil.copytree(case.robot, Path(place) / "robot"))
        out = folder / case.out
        references = {}
        for kind, command in (("new", case.killed), ("old", case.before)):
            shutil.rmtree(out, ignore_errors=True)
            begun = time.perf_counter()
            process = _started(command, folder)
            _wait_for_files(out, process)
            writing = time.perf_counter()
            _end(process, folder)
            seconds, last_part = time.perf_counter() - begun, time.perf_counter() - writing
            references[kind] = _files(out)
        before = references["old"]
        for attempt in range(count):
            process = _started(case.killed, folder)
            if attempt % 2:
                time.sleep(rng.uniform(0.0, seconds))
            else:
                _wait_for_files(out, process)
                time.sleep(rng.uniform(0.0, 1.2 * last_part))
            told = _stopped(process, number, folder)
            raw = _kind(out, before, references["new"], case)
            recover(out)
            settled = _kind(out, before, references["new"], case)
            if settled is None or (raw is not None and raw != settled):
                found["torn"] += 1
            else:
                found[settled if raw == settled else "finished"] += 1
            found["said more than a line"] += told > 1
            if list(folder.rglob(STAGES)):
                found["left over"] += 1
            if attempt % _RERUNS.get(case.name, 1) == 0:
                try:
                    _complete(case.before, folder)
                    found["reruns"] += 1
                except RuntimeError as problem:
                    print(problem, file=sys.stderr)
                    found["no rerun"] += 1
            before = _files(out)
            print(f"\r{case.name}, kill {attempt + 1}: {_told(found)} ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return found


def _started(command: Sequence[str], folder: Path) -> int:
    """The process of a command line, with its progress and messages in `said`; forked, so that what it imports is there already."""
    child = os.fork()
    if child:
        return child
    status = 1
    try:
        os.setsid()
        os.chdir(folder)
        for number in (
            signal.SIGINT,
            signal.SIGHUP,
        ):  # a shell lets what it runs in the background ignore Ctrl-C
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(folder / _SAID, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        status = flexcal(list(command))
    finally:
        os._exit(status)


def _wait_for_files(out: Path, process: int) -> None:
    """Until the first file of a run waits for its place, or the run has ended."""
    while not any(out.glob(f"{STAGES}/[0-9]*")) and _lives(process):
        time.sleep(0.002)


def _lives(process: int) -> bool:
    return os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None


def _stopped(process: int, number: int, folder: Path) -> int:
    """Send a signal to a run, wait for its end, and return the number of lines that are no progress."""
    os.kill(process, number)
    os.waitpid(process, 0)
    for _ in range(100):  # workers end with it
        try:
            os.killpg(process, 0)
        except ProcessLookupError:
            return sum(not line.endswith("…") for line in (folder / _SAID).read_text().splitlines())
        time.sleep(0.05)
    raise AssertionError(f"a process of {process} lives on")


def _complete(command: Sequence[str], folder: Path) -> None:
    """Run a command line to its end; raises `RuntimeError` where it fails."""
    _end(_started(command, folder), folder)


def _end(process: int, folder: Path) -> None:
    if os.waitpid(process, 0)[1]:
        raise RuntimeError((folder / _SAID).read_text())


def _files(out: Path) -> dict[str, str]:
    """SHA-256 of the files in a folder by name, without what waits in hidden folders there."""
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(out.glob("*"))
        if path.is_file()
    }


def _kind(out: Path, before: dict[str, str], new: dict[str, str], case: Case) -> str | None:
    """Which run the files in a folder are of; None where they are not all of one.

    Those of the run before have its digests. Those of the new one have the names and, where no duration stands in them, the digests of one
    that was left to its end, and all those that the ledger has.
    """
    files = _files(out)
    if files == before:
        return "old"
    steady = all(files.get(name) == new[name] for name in case.steady)
    ledger = dict(_ledger(out))
    return (
        "new"
        if files.keys() == new.keys() and steady and all(files[n] == d for n, d in ledger.items())
        else None
    )


def _ledger(out: Path) -> Iterator[tuple[str, str]]:
    for line in (out / LEDGER).read_text().splitlines() if (out / LEDGER).exists() else []:
        if not line.startswith("#"):
            digest, _, name = line.partition("  ")
            yield name, digest


def _told(found: Counter[str]) -> str:
    return ", ".join(f"{count} {what}" for what, count in sorted(found.items()) if count)


def main() -> int:
    """Print the counts, one line a verb and signal; 1 where files were torn or a run did not work."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--cases", nargs="*", default=[case.name for case in CASES])
    parser.add_argument("--signals", nargs="*", default=["KILL", "TERM", "INT", "HUP"])
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    failed = False
    for case in CASES:
        for name in given.signals if case.name in given.cases else ():
            rng = np.random.default_rng(given.seed)
            found = killed_runs(case, getattr(signal, f"SIG{name}"), given.count, rng)
            failed |= bool(
                found["torn"] or found["no rerun"] or found["left over"] or found["said more than a line"]
            )
            print(f"{case.name:10s} SIG{name:5s} {given.count} times: {_told(found)}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
