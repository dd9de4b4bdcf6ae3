from .dask_cluster import DaskCluster
from .local_processes import LocalProcesses
from .opening import open_workers
from .ordered import consecutive_groups
from .outcome import Outcome, TaskError
from .this_process import ThisProcess
from .workers import Workers

__all__ = [
    "DaskCluster",
    "LocalProcesses",
    "Outcome",
    "TaskError",
    "ThisProcess",
    "Workers",
    "consecutive_groups",
    "open_workers",
]
