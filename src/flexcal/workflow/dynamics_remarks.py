"""What a user should know of identified dynamics beside the numbers: which declared terms these recordings do not show."""

from __future__ import annotations

from collections.abc import Iterator

from flexcal.dynamics import RegressionData, attenuation
from flexcal.estimation import Estimate
from flexcal.model.regressor import INERTIAL
from flexcal.workflow.estimators import EstimatorName

_SHOWN = 3
_REGROUPED = ("rotor_inertia", "arm_inertia")
"""What the inertias of links take up as a matter of course."""
_LARGEST_ATTENUATION = 0.5
"""Of a stiffness, in its standard deviations, that is not worth a remark."""


def dynamics_remarks(data: RegressionData, estimate: Estimate, estimator: EstimatorName) -> tuple[str, ...]:
    """One sentence each; every parameter of a drive that a declared term brings and the data do not determine is named.

    So is a controller that was simulated but not declared.
    """
    base = data.base.found
    structural = {base.names[i] for i in base.kept}
    absorbed = {entry.name: entry.absorbed_by for entry in estimate.dropped}
    silent = set(data.silent)
    drives = [name for name in data.names[len(INERTIAL) * data.observation.model.n :] if name not in silent]
    remarks = [
        f"{joint}: {', '.join(keys)} stay as they were: these recordings leave their columns at zero"
        for joint, keys in _by_joint(data.silent).items()
    ]
    if estimator in ("iv", "didim") and data.observation.model.controller is None:
        remarks.append(
            f"robot.yaml declares no controller: {estimator} simulated one that tracks the recorded path, its gains by the inertia"
        )
    for name in drives:
        if name in absorbed and (name in structural or not name.endswith(_REGROUPED)):
            heirs = ", ".join(heir for heir, _ in absorbed[name][:_SHOWN]) or "nothing"
            where = "no recording tells" if name not in structural else "these recordings do not tell"
            remarks.append(f"{where} {name} from {heirs}")
    return (*remarks, *_attenuated(data, estimate))


def _by_joint(names: tuple[str, ...]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name in names:
        joint, _, key = name.rpartition(".")
        found.setdefault(joint, []).append(key)
    return found


def _attenuated(data: RegressionData, estimate: Estimate) -> Iterator[str]:
    for name, share in attenuation(data, estimate).items():
        if share * estimate.values[name] > _LARGEST_ATTENUATION * (estimate.std(name) or 0.0):
            yield (
                f"noise of the positions on either side of the drive may have lowered {name} by up to {100 * share:.2g} %, "
                "which its interval does not hold; larger torques or finer encoders help"
            )
