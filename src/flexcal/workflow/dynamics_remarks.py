"""What a user should know of identified dynamics beside the numbers: which declared terms these recordings do not show."""

from __future__ import annotations

from flexcal.dynamics import RegressionData
from flexcal.estimation import Estimate
from flexcal.workflow.estimators import EstimatorName

_SHOWN = 3


def dynamics_remarks(data: RegressionData, estimate: Estimate, estimator: EstimatorName) -> tuple[str, ...]:
    """One sentence each; every parameter of a drive that a declared term brings and the data do not determine is named.

    So is a controller that was simulated but not declared.
    """
    base = data.base.found
    structural = {base.names[i] for i in base.kept}
    absorbed = {entry.name: entry.absorbed_by for entry in estimate.dropped}
    silent = set(data.silent)
    drives = [name for name in data.names if name.rpartition(".")[0] in data.observation.model.joint_names]
    remarks = []
    if estimator in ("iv", "didim") and data.observation.model.controller is None:
        remarks.append(
            f"robot.yaml declares no controller: {estimator} simulated one that tracks the recorded path, its gains by the inertia"
        )
    for name in drives:
        if name in silent:
            remarks.append(f"{name} stays as it was: these recordings leave its column at zero")
        elif name in absorbed and (name in structural or not name.endswith("rotor_inertia")):
            heirs = ", ".join(heir for heir, _ in absorbed[name][:_SHOWN]) or "nothing"
            where = "no recording tells" if name not in structural else "these recordings do not tell"
            remarks.append(f"{where} {name} from {heirs}")
    return tuple(remarks)
