"""Tasks in worker processes of this machine."""

from __future__ import annotations

import os
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any, TypeVar

from flexcal.parallel.common_values import CommonValues
from flexcal.parallel.outcome import Outcome, TaskError, run_task
from flexcal.parallel.worker_processes import end_with, signals_wait
from flexcal.parallel.workers import Workers

V = TypeVar("V")
LIVES = 3
"""Worker processes that a task may end with before it is given up."""
_AHEAD = 2
"""Tasks a worker that are sent before the last has ended, so that none waits for the next."""
_THREADS = ("OPENBLAS", "OMP", "MKL", "BLIS", "NUMEXPR", "POLARS", "VECLIB")
_GIVEN_UP = f"{LIVES} worker processes ended while they ran this task (killed, out of memory, or crashed)"
_ENVIRONMENT = {f"{library}_NUM_THREADS": "1" for library in _THREADS} | {"POLARS_MAX_THREADS": "1"}


@dataclass(frozen=True)
class _Numbered:
    index: int
    task: Any


class LocalProcesses(Workers):
    """Runs tasks in up to `jobs` processes, no more than tasks, which end with this one, and linear algebra in one thread each.

    Where a worker is killed, all of its tasks and of those beside it run again, one at a time, so that one that kills its worker is known
    for certain: after `LIVES` workers it is an error, and the others go on.
    """

    def __init__(self, jobs: int):
        self._jobs = jobs
        self._pool: Any = None
        self._started = 0

    @property
    def count(self) -> int:
        """As `Workers.count`."""
        return self._jobs

    def results(
        self, function: Callable[..., V], tasks: Iterable[Any], *common: Any
    ) -> Generator[Outcome[V], None, None]:
        """As `Workers.results`; the first tasks begin at once, not when the first outcome is asked for."""
        outcomes = self._outcomes(function, tasks, common)
        next(outcomes)  # the first tasks are sent
        return outcomes  # type: ignore[return-value]

    def _outcomes(
        self, function: Callable[..., V], tasks: Iterable[Any], common: tuple[Any, ...]
    ) -> Generator[Outcome[V] | None, None, None]:
        """None once the first tasks are sent, then the outcomes."""
        shared = CommonValues.of((function, *common))
        numbered = (_Numbered(index, task) for index, task in enumerate(tasks))
        first = list(islice(numbered, _AHEAD * self._jobs))
        needed = min(self._jobs, len(first))
        if needed > self._started:
            self.close()
            self._started = needed
        waiting = chain(first, numbered)
        suspects: deque[_Numbered] = deque()
        deaths: Counter[int] = Counter()
        running: dict[Future[Outcome[V]], _Numbered] = {}
        begun = False
        try:
            while True:
                ahead = 1 if suspects else _AHEAD * self._jobs
                while len(running) < ahead:
                    following = suspects.popleft() if suspects else next(waiting, None)
                    if following is None:
                        break
                    running[self._submit(shared, following)] = following
                if not begun:
                    begun = True
                    yield None
                if not running:
                    return
                ended = wait(running, return_when=FIRST_COMPLETED).done
                if any(_is_broken(future) for future in ended):
                    self.close()  # which ends all of them
                    ended = set(running)
                for future in sorted(ended, key=lambda one: running[one].index):
                    numbered = running.pop(future)
                    if not _is_broken(future):
                        yield _outcome(future, numbered)
                        continue
                    deaths[numbered.index] += 1
                    if deaths[numbered.index] < LIVES:
                        suspects.append(numbered)
                    else:
                        yield Outcome(numbered.index, None, TaskError(None, _GIVEN_UP), 0.0)
        finally:
            if running:
                self.close()

    def close(self) -> None:
        """As `Workers.close`; what still runs is killed."""
        with signals_wait():
            if self._pool is not None:
                self._pool.shutdown(wait=True, kill_workers=True)
                self._pool = None

    def _submit(self, shared: CommonValues, numbered: _Numbered) -> Future[Any]:
        with signals_wait():
            if self._pool is None:
                from joblib.externals.loky.process_executor import ProcessPoolExecutor

                self._pool = ProcessPoolExecutor(
                    self._started, initializer=end_with, initargs=(os.getpid(),), env=_ENVIRONMENT
                )
            try:
                return self._pool.submit(_run_numbered, shared, numbered)
            except _errors_of_the_pool() as problem:  # a worker was killed since the last future ended
                broken: Future[Any] = Future()
                broken.set_exception(problem)
                return broken


def _errors_of_the_pool() -> tuple[type[Exception], ...]:
    from joblib.externals.loky.process_executor import ShutdownExecutorError

    return BrokenExecutor, ShutdownExecutorError


def _is_broken(future: Future[Outcome[V]]) -> bool:
    """Whether the pool ended before the task did."""
    if future.cancelled() or not future.done():
        return True
    return isinstance(future.exception(), _errors_of_the_pool())


def _outcome(future: Future[Outcome[V]], numbered: _Numbered) -> Outcome[V]:
    """What a task that ended gave; where its value could not be sent back, that is its error."""
    problem = future.exception()
    return future.result() if problem is None else Outcome(numbered.index, None, TaskError.of(problem), 0.0)


def _run_numbered(shared: CommonValues, numbered: _Numbered) -> Outcome[Any]:
    function, *common = shared.values()
    return run_task(function, numbered.index, numbered.task, tuple(common))
