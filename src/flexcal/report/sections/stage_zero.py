"""Stage 0: what exciting trajectories tell of the links, and what that buys the stages after."""

from __future__ import annotations

import numpy as np

from flexcal.calibration import Verification
from flexcal.elasticity import StiffnessResult
from flexcal.estimation import Estimate
from flexcal.report.notation import NOTHING, millimetres, significant, spring_label
from flexcal.report.page import Block, Section, Table, Text
from flexcal.report.study import CadAlone, TwoStageStudy

_UNITS = {"kg": (1.0, "kg"), "m": (1e3, "mm"), "kg m²": (1.0, "kg m²")}


def stage_zero_section(study: TwoStageStudy) -> Section | None:
    """Gains over CAD and the inertials themselves; None where stage 0 was left out."""
    if study.dynamics is None:
        return None
    blocks: list[Block] = []
    if study.cad_alone is not None:
        blocks.append(_gain_table(study, study.cad_alone))
    blocks.append(_inertial_table(study, study.dynamics))
    blocks.append(
        Text(
            (
                "The robot followed periodic trajectories without payload; masses, centres of mass, rotors and friction were fitted to its "
                "torques with CAD as the prior. Torques at the motors determine combinations of these only. What they leave open stays as "
                "uncertain as CAD, and both stages know that.",
            )
        )
    )
    return Section(
        "stage0", "Stage 0: link inertials", "What the links weigh, before anything elastic.", tuple(blocks)
    )


def _gain_table(study: TwoStageStudy, cad: CadAlone) -> Table:
    """Both stages from the same data, with the inertials of CAD and with those of stage 0."""
    rows: list[tuple[str, ...]] = []
    names = study.springs("stiffness")
    if study.truth is not None:
        errors = [_errors(study, result) for result in (cad.stiffness, study.stiffness)]
        rows += [
            ("stage 1: largest of all stiffness errors", *(_percent(float(e.max())) for e in errors)),
            ("stage 1: median of all stiffness errors", *(_percent(float(np.median(e))) for e in errors)),
        ]
    for name in names:
        stds = (_relative_std(result.estimate, name) for result in (cad.stiffness, study.stiffness))
        rows.append((f"stage 1: std of {spring_label(name)}", *(_percent(std) for std in stds)))
    both = (cad.verification, study.elastic_verification)
    rows += [
        ("stage 2: mean of the fresh poses / mm", *(millimetres(v.all.mean) for v in both)),
        ("stage 2: 90 % of them within / mm", *(millimetres(v.all.p90) for v in both)),
        ("stage 2: worst / mm", *(millimetres(v.all.max) for v in both)),
        ("stage 2: worst, flank certain / mm", *(millimetres(v.unambiguous.max) for v in both)),
        ("stage 2: what the intervals expect, rms / mm", *(millimetres(_expected(v)) for v in both)),
    ]
    return Table(
        "table-stage0-gain",
        "What stage 0 buys: both stages fitted to the same data",
        ("number", "inertials of CAD alone", "with stage 0"),
        tuple(rows),
    )


def _percent(share: float | None) -> str:
    return NOTHING if share is None else f"{100 * share:.2f} %"


def _errors(study: TwoStageStudy, result: StiffnessResult) -> np.ndarray:
    truth = study.truth or {}
    return np.array([abs(result.estimate.values[n] / truth[n] - 1) for n in study.springs("stiffness")])


def _relative_std(estimate: Estimate, name: str) -> float | None:
    std = estimate.std(name)
    return None if std is None else std / estimate.values[name]


def _expected(verification: Verification) -> float:
    return float(np.sqrt(np.mean(verification.parameter_rms**2)))


def _inertial_table(study: TwoStageStudy, found: Estimate) -> Table:
    rows = []
    for item in found.parameters:
        if item.unit not in _UNITS or item.prior_std == np.inf:
            continue
        factor, unit = _UNITS[item.unit]
        before = item.value if item.prior_mean is None else item.prior_mean
        prior = item.prior_std * (before if item.scale == "log" else 1.0)
        std = found.std(item.name) or np.nan
        cells = [significant(factor * v, 3) for v in (before, prior, item.value, std)]
        if study.truth is not None:
            true = study.truth.get(item.name)
            cells.append(NOTHING if true is None else significant(factor * true, 3))
        rows.append((item.name, unit, *cells))
    columns = ("parameter", "unit", "CAD", "1σ of CAD", "identified", "1σ")
    return Table(
        "table-stage0",
        f"All {len(rows)} inertial parameters",
        columns if study.truth is None else (*columns, "truth"),
        tuple(rows),
        text_columns=(1,),
        folded=True,
    )
