"""A warm process that forks one for each command line of flexcal: `python fuzz_worker.py` answers requests, one JSON document a line.

`python fuzz_worker.py 17` carries out the case 17 alone, says how it ended and where its files are; with a second number all from the first
to before the second, and with `--processes 2` in as many processes. A process of its own, since a fork of one with threads may hang;
forked, since the imports take longer than the runs.
"""

from __future__ import annotations

import argparse
import atexit
import json
import os
import pkgutil
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

CPU_SECONDS = 20
WALL_SECONDS = 60
MEMORY = 6 * 2**30
"""Bytes of addresses, most of which libraries reserve and never touch."""


@dataclass(frozen=True)
class Ending:
    """How a command line ended."""

    status: int
    """Exit status; negative: the signal that ended it."""
    late: bool
    """Whether time ran out."""
    out: str
    err: str
    seconds: float
    """Of processor time."""
    megabytes: float
    """Of memory, at most."""
    orphans: bool = False
    """Whether processes that it started outlived it."""


class Worker:
    """The warm process, for tests; a context manager."""

    def __enter__(self) -> Worker:
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1", "PYTHONUTF8": "1"}
        pipe = subprocess.PIPE
        program = [sys.executable, __file__]
        self._process = subprocess.Popen(program, stdin=pipe, stdout=pipe, text=True, env=environment)
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def _ask(self, **request: object) -> dict[str, Any]:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def run(self, arguments: Sequence[str], folder: Path) -> Ending:
        """How `flexcal` with these arguments ends in `folder`."""
        return Ending(**self._ask(arguments=list(arguments), folder=os.fspath(folder)))

    def fault(self, case: int | tuple[str, str, str]) -> str | None:
        """What is wrong with a case, None where nothing is."""
        return self._ask(case=case)["fault"]


def import_everything() -> None:
    """All verbs, and what they import when they run: modules only, so that no thread is started."""
    sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parent)]
    import flexcal

    names = [module.name for module in pkgutil.walk_packages(flexcal.__path__, "flexcal.")]
    names += [
        "polars",
        "scipy.optimize",
        "scipy.signal",
        "scipy.stats",
        "pinocchio",
        "mujoco",
        "rich.progress",
        "tyro",
    ]
    names += [
        "plotly.graph_objects",
        "cv2",
        "h5py",
        "rosbags.highlevel",
        "fastexcel",
        "viser",
        "pyuff",
        "fuzz_room",
    ]
    for name in names:
        with suppress(ImportError):  # of an optional package, or of kernels for another processor
            import_module(name)


def carry_out(
    arguments: Iterable[str], folder: str, *, serves: bool = False, home: str | None = None
) -> Ending:
    """Run one command line in `folder`; one that `serves` is interrupted when it has said something."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            _run(list(arguments), folder, home, out.fileno(), err.fileno())
        said: Callable[[], bool] = lambda: os.fstat(err.fileno()).st_size + os.fstat(out.fileno()).st_size > 0  # noqa: E731
        status, late, used = _wait(child, said if serves else None)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read(2_000_000).decode("utf-8", "backslashreplace"))
    seconds, megabytes = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    return Ending(status, late, texts[0], texts[1], seconds, megabytes, _end_group(child))


def _run(arguments: list[str], folder: str, home: str | None, out: int, err: int) -> None:
    status = 70
    try:
        os.setsid()
        os.chdir(folder)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        if home is not None:
            os.environ |= {"HOME": home, "TMPDIR": f"{home}/../tmp", "XDG_CACHE_HOME": f"{home}/../../cache"}
            tempfile.tempdir = None
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        atexit._clear()
        from flexcal.cli.main import main

        status = main(arguments)
        sys.stdout.flush()
        atexit._run_exitfuncs()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(status)


def _wait(child: int, said: Callable[[], bool] | None) -> tuple[int, bool, resource.struct_rusage]:
    """Exit status, whether time ran out, and what was used."""
    pause, begun = 0.001, time.monotonic()
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            return code, code in (-signal.SIGXCPU, -signal.SIGKILL), used
        if said is not None and said():
            time.sleep(0.3)
            os.kill(child, signal.SIGINT)
            said = None
        if time.monotonic() > begun + WALL_SECONDS:
            os.killpg(child, signal.SIGKILL)
            _, _, used = os.wait4(child, 0)
            return -signal.SIGKILL, True, used
        time.sleep(pause)
        pause = min(2 * pause, 0.02)


def _end_group(leader: int) -> bool:
    """End what a process has left behind; whether there was something after a second."""
    for _ in range(20):
        try:
            os.killpg(leader, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.05)
    os.killpg(leader, signal.SIGKILL)
    return True


@contextmanager
def seeds_in(folder: Path) -> Iterator[Path]:
    """The valid files, made in a process of their own."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            import fuzz_cases
            import fuzz_seeds

            fuzz_seeds.write_files(folder / "seeds")
            fuzz_seeds.run_verbs(folder / "seeds")
            fuzz_cases.write_variants(folder / "seeds")
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    if os.waitpid(child, 0)[1]:
        raise RuntimeError("the valid files cannot be made")
    yield folder / "seeds"


def serve() -> None:
    """Answer requests {arguments, folder} and {case: its number, or [file, label, command line]} on standard input until it ends."""
    with tempfile.TemporaryDirectory() as folder:
        room = None
        for line in sys.stdin:
            request = json.loads(line)
            if "case" not in request:
                answer = asdict(carry_out(request["arguments"], request["folder"]))
            else:
                from fuzz_room import Room

                if room is None:
                    with seeds_in(Path(folder)) as seeds:
                        room = Room(seeds, Path(folder) / "room")
                answer = {"fault": room.fault(request["case"])}
            print(json.dumps(answer), flush=True)


def run_many(first: int, end: int, processes: int) -> int:
    """Carry out the cases from `first` to before `end`, print faults, and return their number."""
    from fuzz_room import Room

    folder = Path(tempfile.mkdtemp(prefix="fuzz"))
    with seeds_in(folder) as seeds:
        children = []
        for k in range(processes):
            child = os.fork()
            if child == 0:
                room, faults = Room(seeds, folder / f"room_{k}"), 0
                for number in range(first + k, end, processes):
                    fault = room.fault(number, keep=end == first + 1)
                    faults += fault is not None
                    if fault is not None or end == first + 1:
                        print(fault or room.told, flush=True)
                room.report()
                os._exit(min(faults, 100))
            children.append(child)
        statuses = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    print(f"{end - first} cases; files in {folder}")
    return sum(statuses)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("first", nargs="?", type=int)
    parser.add_argument("end", nargs="?", type=int)
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    import_everything()
    if given.first is None:
        serve()
    else:
        sys.exit(min(run_many(given.first, given.end or given.first + 1, given.processes), 1))
