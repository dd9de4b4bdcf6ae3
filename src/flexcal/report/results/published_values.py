"""Published results of a robot, printed beside those of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.units import MILLIMETRE

_NAN = float("nan")


@dataclass(frozen=True, eq=False)
class PublishedValues:
    """Published results of one robot; nan and missing entries are what the publication does not say.

    `springs` are stiffnesses and dampings by parameter name (SI); `calibration` is on the poses that were fitted, `elastic` and `rigid`
    on poses that were not, with and without elasticity in the model; `parameters` and `rank` are modelled and kept geometric errors.
    """

    citation: str
    short: str
    springs: Mapping[str, float] = field(default_factory=dict)
    calibration: ErrorStatistics | None = None
    elastic: ErrorStatistics | None = None
    rigid: ErrorStatistics | None = None
    parameters: int | None = None
    rank: int | None = None
    remarks: tuple[str, ...] = ()


_TABLE_1 = {  # kN m/rad and N m s/rad: drive, bearing_x, bearing_y
    "joint_1": ((143.7, 349.9, 753.5), (115.1, 45.9, 192.1)),
    "joint_2": ((250.7, 797.7, 697.1), (70.6, 52.1, 211.2)),
    "joint_3": ((57.1, 181.4, 149.2), (32.9, 47.6, 39.1)),
}


def _springs() -> dict[str, float]:
    values = {}
    for joint, (stiffness, damping) in _TABLE_1.items():
        for spring, c, d in zip(("drive", "bearing_x", "bearing_y"), stiffness, damping, strict=True):
            values[f"{joint}.{spring}.stiffness"] = c * 1e3
            values[f"{joint}.{spring}.damping"] = d
    return values


TX90L_PAPER = PublishedValues(
    citation=(
        "M. Neubauer, H. Gattringer, A. Müller, A. Steinhauser, W. Höbarth: A two-stage calibration method for industrial robots "
        "with joint and drive flexibilities, Mechanical Sciences, 2015"
    ),
    short="paper",
    springs=MappingProxyType(_springs()),
    calibration=ErrorStatistics(40, _NAN, _NAN, 0.10 * MILLIMETRE),
    elastic=ErrorStatistics(150, _NAN, 0.23 * MILLIMETRE, 0.32 * MILLIMETRE),
    rigid=ErrorStatistics(150, _NAN, _NAN, 0.70 * MILLIMETRE),
    parameters=47,
    rank=30,
    remarks=(
        "The paper measured a real robot; the numbers beside it here may come from a simulated one, whose repeatability, wrist and "
        "temperature are better behaved unless the mismatch options are on.",
        "The paper prints dampings in kN m s/rad; read so, the arm could not resonate. They are read as N m s/rad.",
        "The paper keeps 30 of 47 geometric parameters. With exact derivatives the rank for position measurements is 29, with a gap of "
        "many decades below; one-sided differences blur that gap.",
    ),
)
"""The two-stage calibration of a Stäubli TX90L that this procedure follows."""
