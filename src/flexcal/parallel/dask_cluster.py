"""Tasks on a Dask cluster."""

from __future__ import annotations

import math
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

from flexcal.errors import FlexcalError, InputError
from flexcal.parallel.ordered import combined_groups, value_of
from flexcal.parallel.outcome import Outcome, TaskError, run_task
from flexcal.parallel.workers import Workers

if TYPE_CHECKING:
    from distributed import Future

V = TypeVar("V")
_AHEAD = 2
"""Tasks a thread that are sent before the last has ended, so that none waits for the next."""
_TOGETHER = 8
"""Neighbours that one task combines, a power of two: the tree is the same, with fewer tasks for the scheduler."""
_RECOUNT = 1.0
"""Seconds between two counts of the workers."""
_GIVEN_UP = "all worker processes ended while they ran this task (killed, out of memory, or crashed)"
_one_at_a_time = threading.Lock()
"""Held while a task runs: robots have memory of their own to compute in, and threads of a worker share them."""
_PATIENCE = 30.0
"""Seconds that the scheduler may take to answer, and a first worker to arrive."""


class DaskCluster(Workers):
    """Runs tasks on the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        `dask://host:port`, or `tls://host:port` with certificates as Dask's configuration names them (distributed.comm.tls). Functions and
        values travel as pickles, which can run any code: a cluster must be one's own.

    Raises
    ------
    InputError
        Where the package distributed is missing, no scheduler answers, it has no worker, or a worker has no flexcal or another version.
    """

    client: Any
    """The `distributed.Client`, for what is more than independent tasks."""

    def __init__(self, address: str):
        try:
            from distributed import Client
            from distributed.utils import silence_logging_cmgr
        except ImportError as problem:
            raise InputError(
                "E-WORK-001", f"{address} needs Dask: pip install 'flexcal[cluster]'."
            ) from problem
        self.address = address
        self._threads, self._counted = 0, -math.inf
        self._quiet = ExitStack()
        self._quiet.enter_context(silence_logging_cmgr("critical"))  # of what is one sentence here
        place = address.replace("dask://", "tcp://", 1)
        try:
            self.client = Client(place, timeout=_PATIENCE, set_as_default=False)
        except (OSError, TypeError, ValueError) as problem:  # TypeError: no certificates
            self._quiet.close()
            reason = " ".join(str(problem).split())
            raise InputError(
                "E-WORK-002",
                f"no Dask scheduler can be reached at {address} ({reason}); check the address, and that 'dask scheduler' runs there; "
                "tls:// needs the certificates of distributed.comm.tls in Dask's configuration.",
            ) from problem
        try:
            self._require_workers()
        except BaseException:
            self.close()
            raise

    @property
    def count(self) -> int:
        """As `Workers.count`: threads of all workers."""
        with self._connected():
            return sum(self.client.nthreads().values())

    def results(
        self, function: Callable[..., V], tasks: Iterable[Any], *common: Any
    ) -> Generator[Outcome[V], None, None]:
        """As `Workers.results`.

        Raises `FlexcalError` where the scheduler is lost, and `InputError` where a worker that came later has another flexcal or none.
        """
        from distributed import as_completed

        name = f"flexcal-{uuid.uuid4().hex}"
        client, numbered = self.client, iter(enumerate(tasks))
        shared = self._submitted(_together, function, *common, key=f"common-{name}")
        waiting = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        running: dict[Future, tuple[int, Any]] = {}
        suspects: list[tuple[int, Any]] = []  # each ran beside a killed worker, or killed it

        def send(index: int, task: Any, turn: str) -> None:
            future = self._submitted(_run, shared, index, task, key=f"{name}-{index}-{turn}")
            running[future] = index, task
            waiting.add(future)

        try:
            for index, task in islice(numbered, self._ahead()):
                send(index, task, "first")
            while running:
                future, result = next(waiting)
                index, task = running.pop(future)
                outcome = self._outcome(result, index)
                if outcome is None:
                    suspects.append((index, task))
                else:
                    yield outcome
                for index, task in islice(numbered, max(0, self._ahead() - len(running))):
                    send(index, task, "first")
            for index, task in suspects:  # each alone
                send(index, task, "second")
                future, result = next(waiting)
                del running[future]
                outcome = self._outcome(result, index)
                yield outcome or Outcome(index, None, TaskError(None, _GIVEN_UP), 0.0)
        finally:
            self._cancel([*running, shared])

    def reduced(
        self,
        function: Callable[..., V],
        groups: Sequence[Sequence[Any]],
        combine: Callable[[V, V], V],
        *common: Any,
    ) -> Iterator[V]:
        """As `Workers.reduced`: a graph of futures, of which only the value of each group comes here.

        Raises `FlexcalError` as `results` does.
        """
        name = f"flexcal-{uuid.uuid4().hex}"
        shared = self._submitted(_together, function, combine, *common, key=f"common-{name}")
        roots: list[Future] = []
        try:
            for index, group in enumerate(groups):
                level = [
                    self._submitted(_leaf, shared, task, key=f"{name}-{index}-{leaf}")
                    for leaf, task in enumerate(group)
                ]
                while len(level) > 1:
                    parts = [level[first : first + _TOGETHER] for first in range(0, len(level), _TOGETHER)]
                    level = [self._submitted(_combined, shared, *part) for part in parts]
                roots += level
            while roots:
                yield self._value(roots[0])
                del roots[0]
        finally:
            self._cancel(roots)  # what only they need goes with them

    def _submitted(self, function: Callable[..., Any], *arguments: Any, key: str | None = None) -> Future:
        with self._connected():
            return self.client.submit(function, *arguments, key=key, pure=False)

    def _cancel(self, futures: list[Future]) -> None:
        with suppress(FlexcalError), self._connected():
            self.client.cancel(futures)

    @contextmanager
    def _connected(self) -> Iterator[None]:
        """Raises `FlexcalError` where the connection was lost, even if it is there again: results are gone with it."""
        from distributed.client import ClosedClientError

        if self.client.status != "running":
            raise self._lost()
        try:
            yield
        except (OSError, ClosedClientError) as problem:
            raise self._lost() from problem

    def _value(self, root: Future) -> Any:
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        try:
            return value_of(root.result())
        except CancelledError as problem:
            raise self._lost() from problem
        except KilledWorker as problem:
            raise FlexcalError("E-WORK-008", f"{_GIVEN_UP}; give the workers more memory.") from problem
        except ImportError:
            self._require_same_version()
            raise

    def _lost(self) -> FlexcalError:
        return FlexcalError(
            "E-WORK-003",
            f"the connection to the scheduler at {self.address} was lost; start it again, and go on.",
        )

    def _ahead(self) -> int:
        """Tasks that may be under way; workers that came in the last second may be missing."""
        if time.monotonic() > self._counted + _RECOUNT:
            before, self._threads, self._counted = self._threads, self.count, time.monotonic()
            if self._threads > before:
                self._require_same_version()
        return max(1, _AHEAD * self._threads)

    def close(self) -> None:
        """As `Workers.close`; the cluster goes on."""
        with self._quiet, suppress(TimeoutError):
            self.client.close()

    def _outcome(self, result: Any, index: int) -> Outcome[Any] | None:
        """What a task gave; None where its workers were killed.

        The status of the future is of now: "lost" where the worker was killed after its result had come here.
        """
        from distributed import KilledWorker

        if isinstance(result, Outcome):
            return result
        if not isinstance(result, tuple):  # cancelled, as all are when the connection ends
            raise self._lost()
        problem = result[1]  # of type, exception, traceback
        if isinstance(problem, KilledWorker):
            return None
        if isinstance(problem, ImportError):
            self._require_same_version()
        return Outcome(index, None, TaskError.of(problem), 0.0)  # not readable there, or its value not here

    def _require_workers(self) -> None:
        from distributed.exceptions import WorkerStartTimeoutError

        with self._connected():
            try:
                self.client.wait_for_workers(1, timeout=_PATIENCE)
            except WorkerStartTimeoutError as problem:
                raise InputError(
                    "E-WORK-004",
                    f"the scheduler at {self.address} has no workers; start some with 'dask worker {self.client.scheduler.address}'.",
                ) from problem
        self._require_same_version()

    def _require_same_version(self) -> None:
        from importlib.metadata import version

        def installed() -> str | None:  # travels whole, as a function within a function
            from importlib.metadata import PackageNotFoundError, version

            try:
                import flexcal  # noqa: F401

                return version("flexcal")
            except (ImportError, PackageNotFoundError):
                return None

        own = version("flexcal")
        with self._connected():
            others = self.client.run(installed, on_error="ignore")
        for worker, other in others.items():
            if other != own:
                has = "no flexcal" if other is None else f"flexcal {other}"
                raise InputError(
                    "E-WORK-005",
                    f"the worker {worker} has {has}, and this is flexcal {own}; install the same version in its environment.",
                )


def _together(*values: Any) -> tuple[Any, ...]:
    return values


def _run(shared: tuple[Any, ...], index: int, task: Any) -> Outcome[Any]:
    function, *common = shared
    with _one_at_a_time:
        return run_task(function, index, task, tuple(common))


def _leaf(shared: tuple[Any, ...], task: Any) -> Outcome[Any]:
    function, _, *common = shared
    return _run((function, *common), 0, task)


def _combined(shared: tuple[Any, ...], *parts: Outcome[Any]) -> Outcome[Any]:
    """All values as one; the error of the first task where one has none."""
    for part in parts:
        if part.error is not None:
            return part
    return _run((_tree, shared[1]), 0, [part.value for part in parts])


def _tree(values: list[Any], combine: Callable[[Any, Any], Any]) -> Any:
    return next(combined_groups(iter(values), [values], combine))
