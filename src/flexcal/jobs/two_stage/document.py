"""Document and table of a two-stage run (results.json)."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration.diagnostics import Drift, is_implausible, stated_noise
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import PredictionErrors, prediction_document
from flexcal.estimation import Estimate
from flexcal.export import ExportedFile
from flexcal.jobs.result_files import (
    header,
    identifiability_block,
    identifiability_spectrum,
    quantities,
    springs_block,
)
from flexcal.jobs.stiffness import further_joints
from flexcal.jobs.two_stage.results import CadInertialsRun, TwoStageRun
from flexcal.report.checks import misfit_document
from flexcal.units import MILLIMETRE


def two_stage_document(run: TwoStageRun, exported: ExportedFile) -> dict[str, Any]:
    """The content of results.json."""
    estimate, identifiability, drift = (
        run.stiffness.estimate,
        run.calibration.identifiability,
        Drift.of(run.calibration),
    )
    noise = stated_noise(run.calibration)
    stage_one = {kind: _springs(run, estimate, kind) for kind in ("stiffness", "damping")}
    rigid = {f"rigid_{len(c.poses)}": v for c, v in zip(run.rigid, run.rigid_verification, strict=True)}
    return {
        **header("demo"),
        "dynamics": None if run.dynamics is None else {"parameters": quantities(run.dynamics, run.truth)},
        "cad_alone": None if run.cad_alone is None else _cad_alone(run, run.cad_alone),
        "stage1": stage_one
        | {
            "misfit": misfit_document(estimate.misfit),
            "further_joints": list(further_joints(estimate, run.nominal)),
        }
        | {"reduced_chi2": estimate.reduced_chi2, "status": estimate.status, "message": estimate.message},
        "identifiability": identifiability_block(identifiability) | identifiability_spectrum(identifiability),
        "before": run.before.document(),
        "calibration": run.calibration.errors.in_millimetres(),
        "calibration_fit": {
            "reduced_chi2": noise[0].chi2 if noise else None,
            "stated_noise": [item.document() for item in noise],
            "is_implausible": is_implausible(run.calibration),
            "nominal": run.before.document()["registered"],
            "rigid": run.rigid[0].errors.in_millimetres(),
            "wrong_flanks": None if run.floor is None else wrong_flanks(run),
            "drift": drift.document(),
        },
        "variances": run.calibration.variances,
        "prediction": prediction_document(run.measured_verification, run.measured_covariance),
        "rigid_fits": [{"poses": len(c.poses), "rank": c.identifiability.rank} for c in run.rigid],
        "verification": {
            "nominal": run.nominal_verification.all.in_millimetres(),
            "own": run.own_verification.all.in_millimetres(),
            **_verified(run.elastic_verification),
            "rigid": run.rigid_verification[0].all.in_millimetres(),
            **_measured(run),
            "measured": run.measured_verification.all.in_millimetres(),
            "floor": None if run.floor is None else run.floor.in_millimetres(),
        }
        | {name: v.all.in_millimetres() for name, v in rigid.items()},
        "export": {
            "urdf": exported.path.name,
            "lost": list(exported.lost),
        }
        | (exported.loss.error.in_millimetres() if exported.loss.error else {}),
        "seconds": dict(run.seconds) | {"total": sum(run.seconds.values())},
        "seed": run.seed,
        "truth": dict(run.truth),
        "robot": run.nominal.name,
        "joints": {joint.name: joint.kind for joint in run.nominal.motor_joints},
        "plan": run.plan.name,
        "cell": run.cell,
        "command": run.command,
    }


def _cad_alone(run: TwoStageRun, cad: CadInertialsRun) -> dict[str, Any]:
    """Results of both stages without stage 0, under the same names as those of the run."""
    kinds = ("stiffness", "damping")
    return {
        "stage1": {kind: _springs(run, cad.stiffness.estimate, kind) for kind in kinds},
        "calibration": cad.calibration.errors.in_millimetres(),
        "verification": _verified(cad.verification),
    }


def _measured(run: TwoStageRun) -> dict[str, Any]:
    """Errors of the rigid calibrations at the tracker's readings."""
    seen = run.measured_verification.position + run.measured_verification.errors
    return {
        f"measured_rigid_{len(fit.poses)}": ErrorStatistics.of(seen - verification.position).in_millimetres()
        for fit, verification in zip(run.rigid, run.rigid_verification, strict=True)
    }


def _verified(verification: PredictionErrors) -> dict[str, Any]:
    """Errors of an elastic calibration, and the root mean square expected from the covariance of its parameters."""
    return {
        "elastic": verification.all.in_millimetres(),
        "elastic_unambiguous": verification.unambiguous.in_millimetres(),
        "expected_rms_mm": float(np.sqrt(np.mean(verification.parameter_rms**2))) / MILLIMETRE,
    }


def _springs(run: TwoStageRun, estimate: Estimate, kind: str) -> dict[str, Any]:
    """Every stiffness or damping as a quantity, by joint and spring."""
    return springs_block(estimate, run.truth)[kind]


def wrong_flanks(run: TwoStageRun) -> int:
    """Calibration poses at which the assumed flank of a backlash is not the true one."""
    from flexcal.model.statics import static_equilibrium

    poses = run.calibration.poses
    true = static_equilibrium(run.nominal.with_values(run.truth), poses.q, poses.payload).flank
    return int((true != run.calibration.flank).any(axis=1).sum())
