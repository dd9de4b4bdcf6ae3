"""Dynamics from many long logs on a Dask cluster: memory and time of the workers, and a model of the cost to 1000 of them.

`python -m benchmarks.many_logs --files 10 --samples 1000000 --figure many_logs.html`

Every worker simulates its logs itself, writes each to its own disk, filters it and reduces it to triangular factors; these are joined in
a tree on the workers, to at most 128 groups, which this process fits. The clusters of 1 and of 2 workers take turns. On a machine with
other work wall times tell little: processor times are given beside, and what would be with processors of one's own follows from them.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import pickle
import resource
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.dynamics import CUTOFF_HZ, EXAMPLE, motion
from flexcal.data.recordings import Decimation
from flexcal.data.tables import streamed_table
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData, experiment_system, joined_systems
from flexcal.dynamics.signals import JointLog, Window
from flexcal.estimation import Estimate
from flexcal.jobs.logs.hold_out import MOST_EXPERIMENTS
from flexcal.model.robot import RobotModel
from flexcal.parallel import DaskCluster, ThisProcess, Workers, consecutive_groups, open_workers

T = TypeVar("T")
FILES, SAMPLES, DECIMATION = 10, 1_000_000, 10
LIMIT_MB, SCALING = 400.0, 1.8
_PART = 20_000
_TASKS, _MOVED_MB = 1000, 50
_TOGETHER = 8
"""Systems that a task joins on a cluster."""
_LATENCY = 1e-3
"""Least time of a way that is believed, s: on one machine it is lost in that of the tasks."""
_NETWORK = 1.25e9
"""Bytes a second of the network of the model: 10 Gbit/s."""
_WORKERS = np.unique(np.geomspace(1, 1000, 61).round().astype(int))


@dataclass(frozen=True)
class Simulation:
    """What is common to all logs: the robot with the columns of its equations, and the number of samples of each log."""

    observation: Observation
    samples: int


@dataclass(frozen=True)
class Run:
    """One reduction: wall time (s), processor time (s) and peak memory (MB) of every worker, processor time of this process (s), and the
    estimate.
    """

    wall: float
    processors: tuple[float, ...]
    memory: tuple[float, ...]
    client: float
    estimate: Estimate

    @property
    def alone(self) -> float:
        """Time that would pass with a processor for each worker and one for this process, s."""
        return max(self.processors) + self.client


@dataclass(frozen=True)
class Costs:
    """Measured costs, s: of a log of a million samples to be `simulated`, `read` and filtered, and `reduced` to factors (each pass); of
    joining two systems of `size` bytes, of a task for the scheduler (processor time), of the way of a small value between workers, and of
    the fit.

    `bandwidth` is that between two workers of this machine, bytes a second.
    """

    simulated: float
    read: float
    reduced: float
    joined: float
    size: int
    task: float
    latency: float
    bandwidth: float
    fit: float

    def seconds(self, workers: np.ndarray, logs: int, passes: int = 4) -> dict[str, np.ndarray]:
        """Seconds (W,) of `logs` logs of a million samples on so many `workers` (W,), by their cause.

        Logs are shared out whole; one is read once and reduced in every one of the `passes` (four where friction is chosen). The scheduler
        starts one task at a time, of which one combines eight systems. The groups' trees are as deep as the logarithm to that base of the
        logs in a group, every step after a way over the network; the groups' factors arrive here one after the other. Simulation is no part
        of it.
        """
        groups = min(logs, MOST_EXPERIMENTS)
        depth = int(np.ceil(np.log2(-(-logs // groups)) / np.log2(_TOGETHER)))
        rounds = -(-logs // workers)
        joins = (logs - groups) / np.minimum(workers, groups) + depth * (_TOGETHER - 1)
        each = np.ones(len(workers))
        return {
            "computing": rounds * (self.read + passes * self.reduced),
            "joining": passes * joins * self.joined,
            "transfer": each * passes * (groups + depth) * self.size / _NETWORK,
            "latency": each * passes * (1 + depth) * self.latency,
            "scheduler": each
            * (logs + passes * (logs + (logs - groups) / (_TOGETHER - 1) + groups))
            * self.task,
            "fit": each * self.fit,
        }


def run() -> Iterator[tuple[str, float, str]]:
    """Limit over measured memory, and speed of two workers over one."""
    observation = _observation()
    pairs = [(_on_cluster(observation, 1, 4, SAMPLES), _on_cluster(observation, 2, 4, SAMPLES))]
    for one, two in pairs:
        memory = max(two.memory)
        yield "peak memory of a worker, 4 logs of 1e6 samples", LIMIT_MB / memory, f"{memory:.0f} MB"
        scaling = one.alone / two.alone
        yield (
            "two workers over one, processor time",
            scaling,
            f"{one.alone:.1f} and {two.alone:.1f} s; aim {SCALING}",
        )


def reduced(workers: Workers, observation: Observation, files: int, samples: int) -> Estimate:
    """Estimate from simulated logs, whose factors are joined in a tree."""
    base = BaseParameters.of(observation)
    groups = consecutive_groups(range(files), MOST_EXPERIMENTS)
    systems = workers.reduced(simulated_system, groups, joined_systems, Simulation(observation, samples))
    return weighted_least_squares(RegressionData.of(observation, base, list(systems)))


def simulated_system(number: int, simulation: Simulation) -> ExperimentSystem:
    """Equations of the log of that number, which is made, read and removed here."""
    with tempfile.TemporaryDirectory(prefix="flexcal_many_") as name:
        path = Path(name, "log.parquet")
        simulate(path, number, simulation)
        log = JointLog.read(path, simulation.observation.model, CUTOFF_HZ, path.parent)
        return _equations(log, simulation.observation)


def simulate(path: Path, number: int, simulation: Simulation) -> None:
    """Log of the rigid arm on sums of sines, which goes on where that of the number before ends; torques with noise."""
    first = number * simulation.samples
    with streamed_table(path) as append:
        for start in range(first, first + simulation.samples, _PART):
            part = motion(
                simulation.observation, np.arange(start, min(start + _PART, first + simulation.samples))
            )
            columns = {"t": part.time}
            columns |= {f"q{j + 1}": part.q[:, j] for j in range(part.q.shape[1])}
            append(columns | {f"tau{j + 1}": part.torque[:, j] for j in range(part.q.shape[1])})


def measured_costs(observation: Observation, files: int) -> Costs:
    """Costs of one log in this process, and of tasks and transfers on two workers of this machine."""
    simulation = Simulation(observation, SAMPLES)
    with tempfile.TemporaryDirectory(prefix="flexcal_many_") as name:
        path = Path(name, "log.parquet")
        simulated, _ = _timed(lambda: simulate(path, 0, simulation))
        read, log = _timed(lambda: JointLog.read(path, observation.model, CUTOFF_HZ, path.parent))
        reducing, system = _timed(lambda: _equations(log, observation))
    full = joined_systems(system, system)
    joining = min(_timed(lambda: joined_systems(full, full))[0] for _ in range(5))
    data = RegressionData.of(
        observation, BaseParameters.of(observation), [system] * min(files, MOST_EXPERIMENTS)
    )
    fit, _ = _timed(lambda: weighted_least_squares(data))
    with _cluster(2) as workers:
        task = _timed(lambda: list(workers.reduced(abs, [range(_TASKS)], max)))[0] / (_TASKS * 8 / 7)
        latency, bandwidth = _network(workers)
    return Costs(simulated, read, reducing, joining, len(pickle.dumps(full)), task, latency, bandwidth, fit)


def _network(workers: DaskCluster) -> tuple[float, float]:
    """Seconds of a small value's way from one worker to another, and bytes a second of a large one."""
    client = workers.client
    one, other = client.scheduler_info(n_workers=-1)["workers"]
    seconds = []
    for size in (1, _MOVED_MB * 2**20):
        tried = []
        for _ in range(5):
            there = client.submit(bytes, size, workers=[one], pure=False)
            client.submit(len, there, workers=[one], pure=False).result()
            begun = time.perf_counter()
            client.submit(len, there, workers=[one], pure=False).result()
            stayed = time.perf_counter() - begun
            begun = time.perf_counter()
            client.submit(len, there, workers=[other], pure=False).result()
            tried.append(time.perf_counter() - begun - stayed)
        seconds.append(min(tried))
    return max(seconds[0], _LATENCY), _MOVED_MB * 2**20 / max(seconds[1] - seconds[0], _LATENCY)


def _on_cluster(observation: Observation, count: int, files: int, samples: int) -> Run:
    with _cluster(count) as workers:
        reduced(workers, observation, 2 * count, _PART)  # which loads the modules
        before = workers.client.run(_usage)
        begun, spent = time.perf_counter(), time.process_time()
        estimate = reduced(workers, observation, files, samples)
        wall, client = time.perf_counter() - begun, time.process_time() - spent
        after = workers.client.run(_usage)
    processors = tuple(after[name][0] - before[name][0] for name in after)
    return Run(wall, processors, tuple(usage[1] for usage in after.values()), client, estimate)


class _cluster:
    """Scheduler in this process and so many workers of one thread each, as Dask connects them over TCP."""

    def __init__(self, count: int) -> None:
        self._count = count

    def __enter__(self) -> DaskCluster:
        import distributed

        self._started = distributed.LocalCluster(
            n_workers=self._count, threads_per_worker=1, dashboard_address="127.0.0.1:0"
        )
        address = self._started.scheduler_address.replace("tcp://", "dask://")
        self._workers = open_workers(address, 1)
        workers = self._workers.__enter__()
        assert isinstance(workers, DaskCluster)
        return workers

    def __exit__(self, *problem: object) -> None:
        self._workers.__exit__(None, None, None)
        self._started.close()


def _usage() -> tuple[float, float]:
    """Processor time, s, and peak memory, MB, of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def _equations(log: JointLog, observation: Observation) -> ExperimentSystem:
    return experiment_system(
        observation, log, Decimation(DECIMATION), Window(), mask_standstill=True, batches=1
    )


def _observation() -> Observation:
    model = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    return Observation(replace(model, config=replace(model.config, signals={})), CLASSIC)


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    begun = time.process_time()
    value = work()
    return time.process_time() - begun, value


def figure(costs: Costs, path: Path, logs: Sequence[int] = (200, 10_000)) -> None:
    """Page with the seconds of so many `logs` against the number of workers, in all and by cause."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    drawing = make_subplots(
        1, len(logs), subplot_titles=[f"{count} logs of a million samples" for count in logs]
    )
    for column, count in enumerate(logs, start=1):
        parts = costs.seconds(_WORKERS, count)
        total = np.sum(list(parts.values()), axis=0)
        lines = {"all": total, **parts, "ideal": total[0] / _WORKERS}
        for name, seconds in lines.items():
            dash = {"all": "solid", "ideal": "dash"}.get(name, "dot")
            line = go.Scatter(x=_WORKERS, y=seconds, name=name, line={"dash": dash}, showlegend=column == 1)
            drawing.add_trace(line, row=1, col=column)
    drawing.update_xaxes(type="log", title_text="workers")
    drawing.update_yaxes(type="log", title_text="s")
    drawing.write_html(path, include_plotlyjs="cdn")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--files", type=int, nargs="+", default=[FILES])
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    observation = _observation()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    local = reduced(ThisProcess(), observation, 3, 50_000).parameters.coordinates()
    with _cluster(2) as workers:
        there = reduced(workers, observation, 3, 50_000).parameters.coordinates()
    print(
        f"cluster against this process: largest difference {np.abs(there - local).max():.1e} (of {np.abs(local).max():.3g})"
    )
    for files in options.files:
        for _ in range(options.rounds):
            runs = [_on_cluster(observation, count, files, options.samples) for count in (1, 2)]
            for count, found in enumerate(runs, start=1):
                memory = " and ".join(f"{value:.0f}" for value in found.memory)
                spent = " and ".join(f"{value:.1f}" for value in found.processors)
                print(
                    f"{files} logs of {options.samples} samples, {count} workers: {found.wall:.1f} s; workers {spent} s of a processor, "
                    f"peak {memory} MB; here {found.client:.1f} s; load {os.getloadavg()[0]:.1f}",
                    flush=True,
                )
            one, two = runs
            print(
                f"  {one.wall / two.wall:.2f} times as fast by the wall, {one.alone / two.alone:.2f} by processor time",
                flush=True,
            )
    if options.figure is not None:
        costs = measured_costs(observation, 200)
        print(costs)
        for logs in (200, 10_000):
            parts = costs.seconds(np.array([1, 10, 100, 200, 1000]), logs)
            print(
                logs,
                "logs:",
                {name: seconds.round(2).tolist() for name, seconds in parts.items()},
                np.sum(list(parts.values()), axis=0).round(1),
            )
        figure(costs, options.figure)


if __name__ == "__main__":
    main()
