"""Plans on disk: YAML whose `kind` says which plan it is; for poses also CSV."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from flexcal.data.plans.multisines import MultisinePlan
from flexcal.data.plans.pose_csv import read_pose_table, write_pose_table
from flexcal.data.plans.poses import PosePlan
from flexcal.data.plans.trajectories import TrajectoryPlan
from flexcal.errors import InputError
from flexcal.files.formats import read_yaml_file, write_yaml

Plan = MultisinePlan | TrajectoryPlan | PosePlan
P = TypeVar("P", MultisinePlan, TrajectoryPlan, PosePlan)

_KINDS: dict[str, type[MultisinePlan] | type[TrajectoryPlan] | type[PosePlan]] = {
    "multisine": MultisinePlan,
    "trajectory": TrajectoryPlan,
    "poses": PosePlan,
}


def read_plan(path: str | Path) -> Plan:
    r"""Read a plan of poses, trajectories or frequency experiments.

    Parameters
    ----------
    path : str or Path
        YAML file whose `kind` is `poses`, `trajectory` or `multisine`; plans of poses also as CSV.

    Returns
    -------
    PosePlan or TrajectoryPlan or MultisinePlan
        The plan, of the class that `kind` names.

    Raises
    ------
    InputError
        With file and line, for everything that does not fit.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from flexcal import read_plan
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "plan.yaml"
    ...     _ = file.write_text("kind: poses\nq: [[0, -0.5], [0.3, 0.2], [1.2, 0]]\n")
    ...     read_plan(file).q.shape
    (3, 2)
    """
    if Path(path).suffix == ".csv":
        return read_pose_table(Path(path))
    file = read_yaml_file(path)
    kind = file.data.get("kind") if isinstance(file.data, dict) else None
    if not isinstance(kind, str) or kind not in _KINDS:
        raise file.error(
            "E-PLAN-021",
            ("kind",),
            f"this is no plan, whose kind is one of {', '.join(_KINDS)}; give what 'flexcal design' wrote, "
            "or add for example 'kind: multisine'.",
        )
    return file.structure(_KINDS[kind])


def read_plan_of(path: str | Path, kind: type[P]) -> P:
    """Read a plan that has to be of this class; raises `InputError` otherwise."""
    plan = read_plan(path)
    if not isinstance(plan, kind):
        wanted = next(name for name, cls in _KINDS.items() if cls is kind)
        raise InputError(
            "E-PLAN-022",
            f"{path} line 1: this is a plan of kind '{plan.kind}', but one of kind '{wanted}' is needed here.",
        )
    return plan


def write_plan(path: str | Path, plan: Plan) -> None:
    """Write a plan, atomically, as CSV where the file ends so; `read_plan` gives back the same numbers bit by bit.

    Raises `InputError` for a CSV of anything but poses.
    """
    if Path(path).suffix == ".csv":
        if not isinstance(plan, PosePlan):
            raise InputError(
                "E-PLAN-023", f"{path}: only a plan of poses can be a CSV file; end the name in .yaml."
            )
        write_pose_table(Path(path), plan)
        return
    write_yaml(path, plan)
