"""What a user should know of identified dynamics beside the numbers: which declared terms these recordings do not show."""

from __future__ import annotations

from flexcal.dynamics import RegressionData
from flexcal.estimation import Estimate

_SHOWN = 3


def dynamics_remarks(data: RegressionData, estimate: Estimate) -> tuple[str, ...]:
    """One sentence each; every parameter of a drive that a declared term brings and the data do not determine is named."""
    base = data.base.found
    structural = {base.names[i] for i in base.kept}
    absorbed = {entry.name: entry.absorbed_by for entry in estimate.dropped}
    silent = set(data.silent)
    joints = data.observation.model.joint_names
    drives = [name for name in data.names if name.rpartition(".")[0] in joints and name not in silent]
    remarks = [
        f"{joint}: {', '.join(keys)} stay as they were: these recordings leave their columns at zero"
        for joint, keys in _by_joint(data.silent).items()
    ]
    for name in drives:
        if name in absorbed and (name in structural or not name.endswith("rotor_inertia")):
            heirs = ", ".join(heir for heir, _ in absorbed[name][:_SHOWN]) or "nothing"
            where = "no recording tells" if name not in structural else "these recordings do not tell"
            remarks.append(f"{where} {name} from {heirs}")
    return tuple(remarks)


def _by_joint(names: tuple[str, ...]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name in names:
        joint, _, key = name.rpartition(".")
        found.setdefault(joint, []).append(key)
    return found
