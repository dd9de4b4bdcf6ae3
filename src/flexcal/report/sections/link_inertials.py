"""Stage 0 in the report: link inertials from exciting trajectories, and their effect on later stages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.estimation import Estimate
from flexcal.report.layout import (
    NOTHING,
    Block,
    Section,
    Table,
    Text,
    document_millimetres,
    millimetres,
    significant,
    spring_label,
)
from flexcal.report.results import TwoStageStudy

_UNITS = {"kg": (1.0, "kg"), "m": (1e3, "mm"), "kg m²": (1.0, "kg m²")}


def link_inertials_section(study: TwoStageStudy) -> Section | None:
    """Gains over CAD and the inertials themselves; None where stage 0 was left out."""
    if study.results["dynamics"] is None:
        return None
    blocks: list[Block] = []
    if study.results["cad_alone"] is not None:
        blocks.append(_gain_table(study))
    blocks.append(_inertial_table(study, study.estimates["dynamics"]))
    blocks.append(
        Text(
            (
                "The robot followed periodic trajectories without payload; masses, centres of mass, rotors and friction were fitted to its "
                "torques with CAD as the prior. Torques at the motors determine combinations of these only. Undetermined combinations "
                "keep the uncertainty of CAD, which both stages take into account.",
            )
        )
    )
    return Section(
        "stage0", "Stage 0: link inertials", "Link inertials before elasticity is identified.", tuple(blocks)
    )


def _gain_table(study: TwoStageStudy) -> Table:
    """Both stages from the same data, with the inertials of CAD and with those of stage 0."""
    both = (study.results["cad_alone"], study.results)
    springs = [_stiffnesses(results) for results in both]
    errors = [
        np.array([abs(q["estimate"] / q["truth"] - 1) for q in estimates.values() if q["truth"] is not None])
        for estimates in springs
    ]
    rows: list[tuple[str, ...]] = [
        ("stage 1: largest stiffness error", *(_percent(float(e.max())) for e in errors)),
        ("stage 1: median stiffness error", *(_percent(float(np.median(e))) for e in errors)),
    ]
    for name in (
        name for name in study.springs("stiffness") if all(name in estimates for estimates in springs)
    ):
        stds = (_relative_std(estimates[name]) for estimates in springs)
        rows.append((f"stage 1: std of {spring_label(name)}", *(_percent(std) for std in stds)))
    fresh = [results["verification"] for results in both]
    every = [ErrorStatistics.of_millimetres(verification["elastic"]) for verification in fresh]
    certain = [ErrorStatistics.of_millimetres(verification["elastic_unambiguous"]) for verification in fresh]
    rows += [
        ("stage 2: mean error at fresh poses / mm", *(millimetres(v.mean) for v in every)),
        ("stage 2: P90 at fresh poses / mm", *(millimetres(v.p90) for v in every)),
        ("stage 2: worst / mm", *(millimetres(v.max) for v in every)),
        ("stage 2: maximum, flank certain / mm", *(millimetres(v.max) for v in certain)),
        (
            "stage 2: predicted rms / mm",
            *(document_millimetres(verification["expected_rms_mm"]) for verification in fresh),
        ),
    ]
    return Table(
        "table-stage0-gain",
        "Effect of stage 0: both stages fitted to the same data with and without it",
        ("number", "inertials of CAD alone", "with stage 0"),
        tuple(rows),
    )


def _stiffnesses(results: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """The quantities of stage 1 by parameter name."""
    springs_by_joint = results["stage1"]["stiffness"].items()
    return {
        f"{joint}.{spring}.stiffness": q
        for joint, springs in springs_by_joint
        for spring, q in springs.items()
    }


def _percent(share: float | None) -> str:
    return NOTHING if share is None else f"{100 * share:.2f} %"


def _relative_std(quantity: Mapping[str, Any]) -> float | None:
    return None if quantity["std"] is None else quantity["std"] / quantity["estimate"]


def _inertial_table(study: TwoStageStudy, estimate: Estimate) -> Table:
    rows = []
    for item in estimate.parameters:
        if item.unit not in _UNITS or item.prior_std == np.inf:
            continue
        factor, unit = _UNITS[item.unit]
        before = item.value if item.prior_mean is None else item.prior_mean
        prior = item.prior_std * (before if item.scale == "log" else 1.0)
        std = estimate.std(item.name) or np.nan
        cells = [significant(factor * v, 3) for v in (before, prior, item.value, std)]
        true = study.truth.get(item.name)
        cells.append(NOTHING if true is None else significant(factor * true, 3))
        rows.append((item.name, unit, *cells))
    return Table(
        "table-stage0",
        f"All {len(rows)} inertial parameters",
        ("parameter", "unit", "CAD", "1σ of CAD", "identified", "1σ", "truth"),
        tuple(rows),
        text_columns=(1,),
        folded=True,
    )
