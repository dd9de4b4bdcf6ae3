"""Remarks on identified dynamics: parameters of declared terms that the recordings do not determine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.dynamics.drives import stiffness_attenuation
from flexcal.dynamics.estimators import EstimatorName
from flexcal.dynamics.friction import FrictionSelection
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate
from flexcal.jobs.dynamics.encoder_bias import EncoderBias
from flexcal.model.parts import LINK_PARAMETERS

_CLEAR = 5.0
"""Least distance of a stiffness from zero, in standard deviations, for a remark."""


def undeclared_spring_remarks(data: RegressionData, estimate: Estimate) -> Iterator[str]:
    """Remark for every joint whose identified `cable_stiffness` is clearly not zero: stiffness, rest and what to declare."""
    model = data.observation.model
    known = {entry.joint: entry.stiffness for entry in model.config.dynamics.joint_springs}
    for joint in model.joints:
        name = f"{joint.name}.cable_stiffness"
        std = estimate.std(name) if name in estimate.values else None
        if std is None or abs(estimate.values[name]) <= _CLEAR * std:
            continue
        stiffness, unit = estimate.values[name], "N/m" if joint.kind == "prismatic" else "N m/rad"
        offset = estimate.values.get(f"{joint.name}.torque_offset")
        rest = (
            ""
            if offset is None
            else f", at rest near {-offset / stiffness:.3g} {'m' if joint.kind == 'prismatic' else 'rad'}"
        )
        what = f"the torques of {joint.name} show a spring parallel to it of {stiffness:.4g} {unit} ± {std:.2g}{rest}"
        if (declared := known.get(joint.name)) is not None:
            yield f"{what}, beside the {declared:g} {unit} that robot.yaml declares: correct `stiffness:` under `dynamics: joint_springs:`"
        else:
            yield (
                f"{what}, which robot.yaml does not declare: cables and hoses, or a spring that balances the arm, which "
                f"`dynamics: {{joint_springs: [{{joint: {joint.name}}}]}}` declares"
            )


_SHOWN = 3
_REGROUPED = ("rotor_inertia", "arm_inertia", "spring_torque", "cable_torque", "torque_offset")
_REGROUPED += tuple(f"{name}_offset" for name in ("fx", "fy", "fz", "mx", "my", "mz"))
"""Parameters that are always absorbed, by the inertias of links and by torque offsets."""
_LARGEST_ATTENUATION = 0.5
"""Bias of a stiffness, in its standard deviations, up to which no remark is made."""


def dynamics_remarks(data: RegressionData, estimate: Estimate) -> tuple[str, ...]:
    """Remarks on identified dynamics; names every drive parameter of a declared term that the data do not determine."""
    base = data.base.identifiability
    structural = {base.names[i] for i in base.kept}
    absorbed = {entry.name: entry.absorbed_by for entry in estimate.dropped}
    silent = set(data.silent)
    drives = [
        name for name in data.names[len(LINK_PARAMETERS) * data.observation.model.n :] if name not in silent
    ]
    remarks = [
        f"{joint}: {', '.join(keys)} keep their values: these recordings do not excite them"
        for joint, keys in _by_joint(data.silent).items()
    ]
    for name in drives:
        if name in absorbed and (name in structural or not name.endswith(_REGROUPED)):
            largest = sorted(absorbed[name], key=lambda heir: -abs(heir[1]))
            heirs = ", ".join(heir for heir, _ in largest[:_SHOWN]) or "nothing"
            where = "in any recording" if name not in structural else "in these recordings"
            remarks.append(f"{name} is not identifiable beside {heirs} {where}")
    return tuple(remarks)


_FEWEST_LOGS = 3
_UNLIKE = 1.5
"""Error of the torques of a log, relative to the median of the others, from which it is named."""
_NOTABLE = 0.03
"""Relative error below which no log is named."""


def unlike_log_notes(predictions: Sequence[TorquePrediction]) -> Iterator[str]:
    """Note on the log whose torques the fit misses by far more than those of two or more others."""
    fitted = [item for item in predictions if not item.held_out.all()]
    if len(fitted) < _FEWEST_LOGS:
        return
    measured = [item.measured[~item.held_out] for item in fitted]
    scale = np.sqrt(np.mean(np.concatenate(measured) ** 2, axis=0))
    scale = np.where(scale > 0, scale, np.inf)
    left = [(item.measured - item.predicted)[~item.held_out] / scale for item in fitted]
    errors = np.array([np.sqrt(np.mean(part**2)) for part in left])
    worst = int(errors.argmax())
    others = np.delete(errors, worst)
    if errors[worst] > _UNLIKE * np.median(others) and errors[worst] > _NOTABLE:
        yield (
            f"the torques of {fitted[worst].name} are met worse than those of the {len(others)} other logs: relative error "
            f"{errors[worst]:.1%}, of the others {others.min():.1%} to {others.max():.1%}; was another load, tool or robot recorded, or "
            "another unit?"
        )


def dynamics_notes(
    data: RegressionData, estimate: Estimate, estimator: EstimatorName, encoders: EncoderBias | None
) -> tuple[str, ...]:
    """Notes: an assumed controller, masses that torques do not determine, springs that robot.yaml does not declare, noise of encoders."""
    notes = []
    if estimator in ("iv", "didim") and data.observation.model.controller is None:
        notes.append(
            f"robot.yaml declares no controller: {estimator} simulated one that tracks the recorded path, gains proportional to inertia"
        )
    if estimator == "sdp":
        notes.append(
            "torques determine base parameters alone: single masses, centres of mass and inertias are the physically consistent ones "
            "nearest to the URDF's, and no better known than these"
        )
    noise = _attenuated(data, estimate) if encoders is None else encoders.remarks()
    return (*notes, *undeclared_spring_remarks(data, estimate), *noise)


def selection_remark(friction: FrictionSelection, estimate: Estimate) -> str | None:
    """Effect of other friction terms of equal predictive power on the standard deviations; None if there are none."""
    if friction.uncertainty is None:
        return None
    growth = friction.uncertainty.growth(estimate)
    name, factor = max(growth.items(), key=lambda item: item[1])
    others = len(friction.uncertainty.deviations) - 1
    others = len(friction.uncertainty.deviations) - 1
    sets = "1 other set of friction terms or shapes predicts"
    if others > 1:
        sets = f"{others} other sets of friction terms or shapes predict"
    return (
        f"{sets} the torques about as well; the differences are included in the standard deviations, which are up to {factor:.2g} times as "
        f"large as without them ({name})"
    )


def _by_joint(names: tuple[str, ...]) -> dict[str, list[str]]:
    by_joint: dict[str, list[str]] = {}
    for name in names:
        joint, _, key = name.rpartition(".")
        by_joint.setdefault(joint, []).append(key)
    return by_joint


def _attenuated(data: RegressionData, estimate: Estimate) -> Iterator[str]:
    for name, share in stiffness_attenuation(data, estimate).items():
        if share * estimate.values[name] > _LARGEST_ATTENUATION * (estimate.std(name) or 0.0):
            yield (
                f"encoder noise on either side of the drive may have reduced {name} by up to {100 * share:.2g} %, "
                "which its interval does not include; larger torques or finer encoders help"
            )
