"""Tasks in this process, in processes, and on a Dask cluster: the same values, and what happens to them that end badly."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import dask
import distributed
import numpy as np
import pytest
from refusals import refused
from waiting import PATIENCE, until
from worker_tasks import failing, killing, least_squares

from flexcal.parallel import TaskError, ThisProcess, Workers, open_workers
from flexcal.parallel.worker_processes import signals_wait


@pytest.fixture(scope="module")
def processes() -> Iterator[Workers]:
    with open_workers(None, 2) as workers:
        yield workers


@pytest.fixture(scope="module")
def on_dask(dask_cluster: distributed.LocalCluster) -> Iterator[Workers]:
    with open_workers(dask_cluster.scheduler_address.replace("tcp://", "dask://"), 1) as workers:
        yield workers


@pytest.fixture(params=["this_process", "processes", "on_dask"])
def workers(request: pytest.FixtureRequest) -> Workers:
    return ThisProcess() if request.param == "this_process" else request.getfixturevalue(request.param)


PARTIES = ("scheduler", "worker", "client")
others = pytest.mark.parametrize("workers", ["processes", "on_dask"], indirect=True)


def test_values_are_the_same_bit_for_bit(workers: Workers) -> None:
    assert workers.count == (1 if isinstance(workers, ThisProcess) else 2)
    outcomes = {outcome.index: outcome for outcome in workers.results(least_squares, range(10), 40)}
    assert sorted(outcomes) == list(range(10))
    for index, outcome in outcomes.items():
        assert outcome.error is None and outcome.value is not None and outcome.seconds > 0
        np.testing.assert_array_equal(outcome.value, least_squares(index, 40))


def test_an_exception_is_the_error_of_its_task(workers: Workers) -> None:
    outcomes = {outcome.index: outcome for outcome in workers.results(failing, range(6))}
    assert {k: o.value for k, o in outcomes.items() if o.error is None} == {0: 0, 1: 1, 5: 5}
    assert outcomes[2].error == TaskError("E-CAL-900", "a.csv line 3: the loop was open; close it.")
    assert outcomes[3].error == TaskError(None, "ValueError: no number")
    assert outcomes[4].error == TaskError(None, "SystemExit: 1")


@others
def test_the_tasks_of_a_killed_worker_run_again_and_count_once(workers: Workers, tmp_path: Path) -> None:
    outcomes = list(workers.results(killing, range(12), tmp_path, 5, 1))
    assert sorted(outcome.index for outcome in outcomes) == list(range(12))
    assert [outcome.value for outcome in sorted(outcomes, key=lambda one: one.index)] == list(range(12))
    assert (tmp_path / "5_1").exists()


@others
def test_what_is_left_is_cancelled_and_the_workers_serve_again(workers: Workers) -> None:
    taken: list[int] = []
    started = workers.results(least_squares, (taken.append(k) or k for k in range(1000)), 40)
    next(started)
    started.close()  # type: ignore[attr-defined]
    assert len(taken) < 100  # tasks are made as they are needed
    assert len(list(workers.results(failing, [0, 1]))) == 2


def test_workers_that_are_killed_between_two_calls_are_started_again() -> None:
    with open_workers(None, 2) as workers:
        assert list(workers.values(least_squares, range(3), 40))
        pool = workers._pool  # type: ignore[attr-defined]
        for process in pool._processes.values():
            os.kill(process.pid, signal.SIGKILL)
        until(lambda: pool._flags.broken is not None)  # from here on the pool refuses tasks
        assert list(workers.values(failing, [0, 1, 5])) == [0, 1, 5]


def test_no_more_processes_than_tasks_and_two_a_core() -> None:
    with open_workers(None, 300) as workers:
        for tasks in (1, 2):
            assert list(workers.values(failing, range(tasks))) == list(range(tasks))
            assert len(workers._pool._processes) == tasks  # type: ignore[attr-defined]
        assert workers.count == 2 * (os.cpu_count() or 1)


def test_a_signal_waits_until_processes_have_started() -> None:
    reached = []
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell lets what runs in the background ignore it
    try:
        with pytest.raises(KeyboardInterrupt), signals_wait():
            signal.raise_signal(signal.SIGINT)
            reached.append("the end of the block")
    finally:
        signal.signal(signal.SIGINT, before)
    assert reached


def test_a_task_that_kills_every_worker_is_an_error_and_the_others_go_on(tmp_path: Path) -> None:
    check_deadly(None, tmp_path)
    assert len(list(tmp_path.glob("5_*"))) == 3


@pytest.mark.slow
def test_also_on_a_cluster(dask_address: str, tmp_path: Path) -> None:
    check_deadly(dask_address, tmp_path)


def check_deadly(on: str | None, folder: Path) -> None:
    with open_workers(on, 2) as workers:
        outcomes = {o.index: o for o in workers.results(killing, range(12), folder, 5, 1000)}
    assert sorted(outcomes) == list(range(12))
    assert [index for index, outcome in outcomes.items() if outcome.error is not None] == [5]
    error = outcomes[5].error
    assert error is not None and error.code is None and "worker processes ended" in error.sentence


def test_an_address_that_is_none() -> None:
    for wrong in ("10.0.0.1:8786", "dask://host", "ray://host:1", "dask://:3"):
        with refused("E-WORK-006", wrong), open_workers(wrong, 1):
            pass


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flexcal.parallel.dask_cluster._PATIENCE", 0.3)
    with closing(socket.socket()) as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"dask://127.0.0.1:{taken.getsockname()[1]}"
        with refused("E-WORK-002", address), open_workers(address, 1):
            pass


def test_a_scheduler_without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    waits = distributed.Client.wait_for_workers
    monkeypatch.setattr(
        distributed.Client, "wait_for_workers", lambda client, count, timeout: waits(client, count, 0.3)
    )
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as empty:
        address = empty.scheduler_address.replace("tcp://", "dask://")
        with refused("E-WORK-004", address, empty.scheduler_address), open_workers(address, 1):
            pass


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with refused("E-WORK-001", "flexcal[cluster]"), open_workers("dask://127.0.0.1:1", 1):
        pass


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("sys.path.insert(0, sys.argv.pop())", "flexcal 0.0.9"),
        ("sys.modules['flexcal'] = None; sys.argv.pop()", "no flexcal"),
    ],
    ids=["other", "none"],
)
def test_a_worker_of_another_version(
    change: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What another flexcal says of itself is found before this one; or none is found."""
    monkeypatch.setattr("flexcal.parallel.dask_cluster._PATIENCE", PATIENCE)
    information = tmp_path / "flexcal-0.0.9.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: flexcal\nVersion: 0.0.9\n")
    start = f"import sys; {change}; from distributed.cli.dask_worker import main; main()"
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as empty:
        words = [empty.scheduler_address, "--no-nanny", "--no-dashboard", "--nthreads", "1", str(tmp_path)]
        worker = subprocess.Popen([sys.executable, "-c", start, *words], stderr=subprocess.DEVNULL)
        try:
            address = empty.scheduler_address.replace("tcp://", "dask://")
            with refused("E-WORK-005", said), open_workers(address, 1):
                pass
        finally:
            worker.kill()
            worker.wait()


@pytest.mark.skipif(shutil.which("openssl") is None, reason="makes its certificate with openssl")
def test_encrypted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Certificates come from Dask's own configuration; without them the scheduler is not reached."""
    key, certificate = str(tmp_path / "key.pem"), str(tmp_path / "certificate.pem")
    subprocess.run(
        f"openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -keyout {key} -out {certificate} -days 2 "
        "-subj /CN=localhost",
        shell=True,
        check=True,
        capture_output=True,
    )
    settings = {
        f"{who}.{what}": file for who in PARTIES for what, file in (("cert", certificate), ("key", key))
    }
    settings = {
        f"distributed.comm.tls.{name}": file for name, file in [*settings.items(), ("ca-file", certificate)]
    }
    with dask.config.set(settings):
        security = distributed.Security(require_encryption=True)
    monkeypatch.setattr("flexcal.parallel.dask_cluster._PATIENCE", PATIENCE)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=":0", security=security, protocol="tls://"
    ) as cluster:
        with (
            dask.config.set(settings),
            open_workers(cluster.scheduler_address, 1) as w,
        ):
            assert list(w.values(failing, [0, 1])) == [0, 1]
        monkeypatch.setattr("flexcal.parallel.dask_cluster._PATIENCE", 0.3)
        with refused("E-WORK-002", cluster.scheduler_address), open_workers(cluster.scheduler_address, 1):
            pass
