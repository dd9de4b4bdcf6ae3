from .dask_cluster import DaskCluster
from .local_processes import LocalProcesses
from .opening import open_workers
from .outcome import Outcome, TaskError
from .this_process import ThisProcess
from .worker_processes import WorkerTask, start_workers
from .workers import Workers

__all__ = [
    "DaskCluster",
    "LocalProcesses",
    "Outcome",
    "TaskError",
    "ThisProcess",
    "WorkerTask",
    "Workers",
    "open_workers",
    "start_workers",
]
