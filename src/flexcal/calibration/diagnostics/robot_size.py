"""What the size of a calibrated robot rests on where no instrument of points told it: nominal lengths, boards, sockets and wires."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from flexcal.calibration.error_model import joint_rotation_jacobian
from flexcal.calibration.fit import LENGTH_TOLERANCE, GeometricFit, common_lengths, error_kind
from flexcal.calibration.kinds import KINDS
from flexcal.calibration.measurement import predict_measurements
from flexcal.estimation import Parameters
from flexcal.model.robot import GEOMETRY, ORIGIN, STATION, RobotModel, propagated_covariance_root

_CONTRADICTED = 2.0
"""Deviation of a standard from which it and all else disagree, in standard deviations of both together: one in twenty by chance."""
_NEW = 0.1
"""Relative standard deviation by all else from which the readings say nothing of a standard."""
_FREE = 10.0
"""Standard deviation, m or rad, of what nothing is known of beforehand."""
_POSES = 60
_LENGTHS = "the lengths of "
_PER_MILLE = 1e-3


@dataclass(frozen=True)
class LengthStandard:
    """Known lengths of an instrument: relative standard deviation `declared`, and how much larger than declared they are by all else.

    `seen` with its standard deviation `seen_std` is by the robot's nominal lengths and the other readings, without what is declared of the
    standard itself: None where these say nothing.
    """

    name: str
    declared: float
    seen: float | None
    seen_std: float | None

    @property
    def contradicted(self) -> bool:
        """Whether what is declared and what is seen do not go together."""
        if self.seen is None or self.seen_std is None:
            return False
        return abs(self.seen) > _CONTRADICTED * float(np.hypot(self.declared, self.seen_std))

    @property
    def sentence(self) -> str:
        """How large it is by all else; empty where that says nothing."""
        if self.seen is None or self.seen_std is None:
            return ""
        size = f"{abs(self.seen) / _PER_MILLE:.2g} ± {self.seen_std / _PER_MILLE:.1g} ‰"
        verb = "are" if self.name.startswith(_LENGTHS) else "is"
        return f"{self.name} {verb} {size} {'larger' if self.seen > 0 else 'smaller'}"


@dataclass(frozen=True)
class RobotSize:
    """Size of a robot: relative standard deviation `std` of its lengths in common, and the `standards` that it rests on.

    `nominal` is the relative standard deviation of the nominal lengths in common; None where they are no prior.
    """

    std: float
    nominal: float | None
    standards: tuple[LengthStandard, ...]

    @classmethod
    @lru_cache(maxsize=1)
    def of(cls, fit: GeometricFit) -> RobotSize | None:
        """What the size of a calibrated robot rests on; None where an instrument of points, or other robots of the model, tell it."""
        poses = fit.poses.pointed
        if not len(poses) or (poses.located & ~poses.seen).any() or fit.fleet is not None:
            return None
        parameters = fit.estimate.parameters
        declared = {name: own for name, own in _declared(fit).items() if name in parameters}
        standards = _seen(fit, declared) if declared else ()
        lengths = [p for p in parameters if ".length_" in p.name and not p.name.startswith("tool.")]
        known = any(np.isfinite(p.prior_std) for p in lengths) and not fit.size
        rows = np.linspace(0, len(poses) - 1, min(len(poses), _POSES)).astype(int)
        some = replace(poses.subset(rows), kind=None, socket=None, holder=None)

        def extent(robot: RobotModel) -> np.ndarray:
            at = predict_measurements(robot, some, elastic=False).kinematics.position
            return np.array([np.log(np.linalg.norm(at - at.mean(axis=0)))])

        owners = (*fit.model.joint_names, "tool", *(f"point.{target}" for target in poses.targets))
        std = float(np.linalg.norm(propagated_covariance_root(fit.model, extent, owners)))
        return cls(std, fit.model.prior.scale if known else None, standards)

    @property
    def sentence(self) -> str:
        """What the size rests on, and how well the lengths agree that it rests on."""
        rests = [f"{item.name} (± {item.declared / _PER_MILLE:.2g} ‰)" for item in self.standards]
        if self.nominal is not None:
            rests.append(f"its own nominal lengths (± {self.nominal / _PER_MILLE:.2g} ‰ in common)")
        size = f"all lengths of the robot are known to ± {self.std / _PER_MILLE:.2g} ‰ (1σ) in common"
        if not self.standards:
            return (
                f"none of these readings tells how large the robot is: {size}, from {rests[0]}; measure with a wire, sockets at a known "
                "distance or an instrument of points too where that matters"
            )
        seen = [item.sentence for item in self.standards if item.sentence]
        by = "its nominal lengths alone" if len(self.standards) == 1 else "all else"
        agree = f"; by {by} {' and '.join(seen)} than declared (1σ)" if seen else ""
        wrong = ". These do not go together: measure them again, and correct robot.yaml"
        return f"{size}, from {' and '.join(rests)}{agree}{wrong if self.contradicted else ''}"

    @property
    def contradicted(self) -> bool:
        """Whether declared lengths do not go together."""
        return any(item.contradicted for item in self.standards)

    def document(self) -> dict[str, Any]:
        """Block of results.json."""
        return {
            "std": self.std,
            "nominal_std": self.nominal,
            "contradicted": self.contradicted,
            "standards": [
                {
                    "name": item.name,
                    "std": item.declared,
                    "seen": item.seen,
                    "seen_std": item.seen_std,
                }
                for item in self.standards
            ],
        }


def _declared(fit: GeometricFit) -> Mapping[str, tuple[str, float]]:
    """Scales of boards, sockets and wires, each with what it is of and its declared standard deviation."""
    model, poses = fit.model, fit.poses
    several = len(poses.holders) > 1
    labels = {name: "the board" for name in ("board.scale",)}
    labels |= {
        f"sockets.{name}.scale": "the distance of the sockets" + (f" of {name}" if several else "")
        for name in poses.holders
    }
    labels |= {f"station.{name}.scale": f"{_LENGTHS}{name}" for name in poses.stations}
    stds = {name: kind.scale_std(model, name) for kind in KINDS for name in kind.scales(poses)}
    instruments = zip(fit.prior.parameters.names, np.sqrt(np.diag(fit.prior.covariance)), strict=True)
    stds |= {name: float(std) for name, std in instruments if name in labels}
    return {name: (labels[name], std) for name, std in stds.items() if std is not None}


def _seen(fit: GeometricFit, declared: Mapping[str, tuple[str, float]]) -> tuple[LengthStandard, ...]:
    """Standards as all else sees them: linear least squares about the calibrated robot, each without what is declared of itself.

    Lengths have their tolerance of manufacture there, not the larger one that the readings made likely, by which they would follow the
    standard.
    """
    model, estimate = fit.model, fit.estimate
    at = predict_measurements(model, fit.poses, jacobians=True)
    items = [p for p in estimate.parameters if p.name in declared or _is_geometric(p.name)]
    names = tuple(item.name for item in items)
    rows = ~np.isin(at.readings.row, estimate.outliers)
    white = fit.scatter.whitening(at.readings, joint_rotation_jacobian(at)).subset(rows)
    columns, residual = white(at.jacobian(names)[rows]), white(at.residual[rows])
    values = np.array([item.value for item in items])
    std = np.array(
        [
            declared[item.name][1]
            if item.name in declared
            else (model.prior.length or LENGTH_TOLERANCE)
            if error_kind(model, item.name) == "m"
            else item.prior_std
            for item in items
        ]
    )
    # what nothing is known of beforehand may be off by far more than any robot
    std = np.where(np.isfinite(std), std, _FREE)
    lengths = Parameters(replace(item, prior_std=float(size)) for item, size in zip(items, std, strict=True))
    common = model.prior.scale * common_lengths(model, lengths)
    gram, along = columns.T @ columns, columns.T @ (residual + columns @ values)
    found = []
    for name, (label, size) in declared.items():
        k = names.index(name)
        wide = std.copy()
        wide[k] = 1.0
        scaled = np.outer(wide, wide) * gram
        prior = np.eye(len(names)) + np.outer(common / wide, common / wide)
        inner = np.linalg.inv(np.linalg.inv(prior) + scaled)
        value, spread = float(wide[k] * (inner[k] @ (wide * along))), float(wide[k] * np.sqrt(inner[k, k]))
        found.append(
            LengthStandard(label, size, value, spread)
            if spread < _NEW
            else LengthStandard(label, size, None, None)
        )
    return tuple(found)


def _is_geometric(name: str) -> bool:
    """Whether a parameter is an error of the geometry, or where an instrument stands."""
    owner, _, key = name.rpartition(".")
    if key == "scale" or owner.startswith("scatter"):
        return False
    return key in (*GEOMETRY, *ORIGIN, *STATION, "zero") or "compliance" in key
