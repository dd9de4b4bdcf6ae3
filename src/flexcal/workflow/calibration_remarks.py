"""What a user should know of a calibration beside its numbers: what it rests on, and what makes it hard to believe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration import Calibration, Drift, moved_far
from flexcal.model.declared import UNIDENTIFIED_STIFFNESS
from flexcal.units import MILLIMETRE
from flexcal.workflow.pose_remarks import unused_columns

_LOOK = (
    "these data hardly fit this robot: look for a column with a wrong sign, unit or place in the order, for points of another "
    "target or robot, and for a wrong xyz under `points:` (flexcal import looks for these); --loss cauchy finds single wrong points"
)

_ABSURD = 100.0
"""Reduced chi-square from which the data cannot be what they say."""

_LARGEST_SCATTER = 1e-3
"""Scatter (m) that no calibrated arm and no instrument has."""

_SHOWN = 3


@dataclass(frozen=True)
class Outlier:
    """A measurement that the robust loss gave hardly any weight: number of its pose, point, distance from the fit (m)."""

    pose: int
    target: str
    error: float


def outliers_of(fit: Calibration) -> tuple[Outlier, ...]:
    """The outliers of a fit, the farthest first."""
    distance = np.linalg.norm(fit.residuals, axis=1)
    rows = sorted(fit.estimate.outliers, key=lambda row: -distance[row])
    return tuple(Outlier(int(fit.poses.pose[i]), str(fit.poses.target[i]), float(distance[i])) for i in rows)


def calibration_remarks(fit: Calibration) -> tuple[str, ...]:
    """One sentence each, the most important last."""
    remarks = [*unused_columns(fit.poses), *_nominal_springs(fit)]
    if fit.ambiguous.any():
        remarks.append(f"{fit.ambiguous.sum()} poses do not surely rest on one flank of a backlash")
    outliers = outliers_of(fit)
    if outliers:
        listed = ", ".join(f"pose {o.pose} ({o.error / MILLIMETRE:.2f} mm)" for o in outliers)
        remarks.append(f"{len(outliers)} outliers: {listed}")
    remarks += _noise(fit)
    drift = Drift.of(fit)
    if drift.certain:
        remarks.append(
            f"residuals drift with time (p = {drift.probability:.1g}), by {drift.distance / MILLIMETRE:.3f} mm from first to last pose: "
            "robot or instrument warmed up or settled, or place and order are correlated"
        )
    far = moved_far(fit)
    if far:
        named = [f"{m.name} ({m.start:.4g} to {m.value:.4g} {m.unit})" for m in far[:_SHOWN]]
        more = f" and {len(far) - _SHOWN} others" if len(far) > _SHOWN else ""
        remarks.append(f"implausibly far from where the fit began: {', '.join(named)}{more}")
    if hardly_fits(fit):
        remarks.append(_LOOK)
    if not fit.estimate.converged:
        remarks.append(f"the fit has not converged ({fit.estimate.status}); do not trust it")
    return tuple(remarks)


def hardly_fits(fit: Calibration) -> bool:
    """Whether data and robot can hardly belong together, so that nothing should be built on the fit."""
    return bool(moved_far(fit)) or _noise_is_absurd(fit)


def _nominal_springs(fit: Calibration) -> Sequence[str]:
    """Springs that stage 1 did not identify have a declared prior of their own in place of its posterior."""
    springs = [p for p in fit.prior.parameters if p.name.endswith(".stiffness")]
    nominal = [p.name.removesuffix(".stiffness") for p in springs if np.isfinite(p.prior_std)]
    if not nominal:
        return ()
    which = "" if len(nominal) == len(springs) else f" of {', '.join(nominal)}"
    return (
        f"the stiffness{which} was not identified: the nominal one of robot.yaml is taken to be right to {UNIDENTIFIED_STIFFNESS:.0%}; "
        "run 'flexcal identify stiffness' first to know it",
    )


def _noise(fit: Calibration) -> Sequence[str]:
    if not fit.poses.sigma_given:
        text = f"no sigma in the files: the scatter of {_scatter(fit) / MILLIMETRE:.3f} mm a coordinate stands for it"
        return (f"{text}, though it is too much to be noise" if _noise_is_absurd(fit) else text,)
    if not fit.estimate.unexplained:
        return ()
    ratio = fit.estimate.reduced_chi2
    return (
        f"chi-square is {ratio:.2g} times what sigma explains: the model lacks something or sigma is too small, and the intervals are "
        "too narrow",
    )


def _noise_is_absurd(fit: Calibration) -> bool:
    if fit.poses.sigma_given:
        return fit.estimate.reduced_chi2 > _ABSURD
    return _scatter(fit) > _LARGEST_SCATTER


def _scatter(fit: Calibration) -> float:
    return float(np.sqrt(np.mean(fit.poses.sigma**2)))
