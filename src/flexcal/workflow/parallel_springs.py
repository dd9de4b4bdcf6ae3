"""Springs parallel to a joint that the torques show and robot.yaml does not declare."""

from __future__ import annotations

from collections.abc import Iterator

from flexcal.dynamics import RegressionData
from flexcal.estimation import Estimate

_CLEAR = 5.0
"""Standard deviations from zero, at least, of a stiffness that is worth a sentence."""


def undeclared_springs(data: RegressionData, estimate: Estimate) -> Iterator[str]:
    """A sentence for every joint whose identified `cable_stiffness` is clearly not zero: stiffness, rest and what to declare."""
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
