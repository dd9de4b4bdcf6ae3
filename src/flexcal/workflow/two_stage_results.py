"""The document and the table that a two-stage run leaves for scripts (FORMATS: results.json, verification.csv)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from flexcal.atomic import write_text
from flexcal.calibration import ErrorStatistics
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.export import Exported
from flexcal.model.names import SPRINGS
from flexcal.report.study import CadAlone, TwoStageStudy
from flexcal.workflow.results import identifiability_block, quantities

VERIFICATION = "verification.csv"


def two_stage_document(study: TwoStageStudy, exported: Exported) -> dict[str, Any]:
    """The content of results.json."""
    truth = study.truth or {}
    estimate = study.stiffness.estimate
    stage_one = {kind: _springs(study, estimate, kind) for kind in ("stiffness", "damping")}
    measured = study.measured_verification
    rigid = {f"rigid_{len(c.poses)}": v for c, v in zip(study.rigid, study.rigid_verification, strict=True)}
    return {
        "dynamics": None if study.dynamics is None else {"parameters": quantities(study.dynamics, truth)},
        "cad_alone": None if study.cad_alone is None else _cad_alone(study, study.cad_alone),
        "stage1": stage_one
        | {"reduced_chi2": estimate.reduced_chi2, "status": estimate.status, "message": estimate.message},
        "identifiability": identifiability_block(study.calibration.identifiability),
        "calibration": study.calibration.errors.in_millimetres(),
        "calibration_fit": {
            "reduced_chi2": study.calibration.estimate.reduced_chi2,
            "nominal": study.nominal_at_calibration.all.in_millimetres(),
            "rigid": study.rigid[0].errors.in_millimetres(),
            "wrong_flanks": wrong_flanks(study),
        },
        "verification": {
            "nominal": study.nominal_verification.all.in_millimetres(),
            "elastic": study.elastic_verification.all.in_millimetres(),
            "elastic_unambiguous": study.elastic_verification.unambiguous.in_millimetres(),
            "rigid": study.rigid_verification[0].all.in_millimetres(),
            "measured": (measured.all if measured else ErrorStatistics.of(np.zeros((0, 3)))).in_millimetres(),
            "floor": study.floor.in_millimetres() if study.floor else None,
        }
        | {name: v.all.in_millimetres() for name, v in rigid.items()},
        "export": {
            "urdf": exported.path.name,
            "lost": list(exported.lost),
        }
        | (exported.loss.error.in_millimetres() if exported.loss.error else {}),
        "seconds": dict(study.seconds) | {"total": sum(study.seconds.values())},
        "seed": study.seed,
        "robot": study.nominal.name,
        "joints": {joint.name: joint.kind for joint in study.nominal.joints},
        "plan": study.plan.name,
        "command": study.command,
    }


def _cad_alone(study: TwoStageStudy, cad: CadAlone) -> dict[str, Any]:
    """The numbers of both stages without stage 0, under the names of the run's own."""
    kinds = ("stiffness", "damping")
    return {
        "stage1": {kind: _springs(study, cad.stiffness.estimate, kind) for kind in kinds},
        "calibration": cad.calibration.errors.in_millimetres(),
        "verification": {
            "elastic": cad.verification.all.in_millimetres(),
            "elastic_unambiguous": cad.verification.unambiguous.in_millimetres(),
        },
    }


def _springs(study: TwoStageStudy, estimate: Estimate, kind: str) -> dict[str, Any]:
    """Every stiffness or damping as a quantity, by joint and spring."""
    truth = study.truth or {}
    return {
        joint.name: {
            SPRINGS[c]: estimate.quantity(
                f"{joint.name}.{SPRINGS[c]}.{kind}", truth.get(f"{joint.name}.{SPRINGS[c]}.{kind}")
            )
            for c in joint.components
        }
        for joint in study.nominal.elastic
    }


def wrong_flanks(study: TwoStageStudy) -> int:
    """Calibration poses at which the flank assumed for a backlash is not the true one."""
    from flexcal.model import static_equilibrium

    if study.truth is None:
        return 0
    poses = study.calibration.poses
    true = static_equilibrium(study.nominal.with_values(study.truth), poses.q, poses.payload).flank
    return int((true != study.calibration.flank).any(axis=1).sum())


@dataclass(frozen=True, eq=False)
class StoredVerification:
    """Joint positions `q` (N, n), true points `truth` (N, 3) m, and the `errors` (N, 3) m of the elastic and the rigid model."""

    q: np.ndarray
    truth: np.ndarray
    errors: dict[str, np.ndarray]


def read_verification(path: Path) -> StoredVerification:
    """What `write_verification` left; raises `InputError` where it cannot be read."""
    try:
        table = pl.read_csv(path)
        q = table.select([name for name in table.columns if name[0] == "q"]).to_numpy()
        truth = table.select("x", "y", "z").to_numpy()
        errors = {
            kind: truth - table.select(f"{kind}_x", f"{kind}_y", f"{kind}_z").to_numpy()
            for kind in ("elastic", "rigid")
        }
        return StoredVerification(q, truth, errors)
    except (pl.exceptions.PolarsError, TypeError) as problem:
        raise InputError(
            f"{path} cannot be read ({' '.join(str(problem).split())}); run the verb that leaves it again."
        ) from problem


def write_verification(path: Path, study: TwoStageStudy) -> None:
    """Write verification.csv: pose, q1…, x, y, z (noise-free truth), elastic_x…, rigid_x…, unambiguous; m and rad."""
    poses, elastic, rigid = study.verification_poses, study.elastic_verification, study.rigid_verification[0]
    header = ["pose", *(f"q{i}" for i in range(1, poses.q.shape[1] + 1)), "x", "y", "z"]
    header += [f"{kind}_{axis}" for kind in ("elastic", "rigid") for axis in "xyz"] + ["unambiguous"]
    numbers = np.hstack([poses.q, poses.position, elastic.position, rigid.position])
    lines = [",".join(header)]
    for pose, row, ambiguous in zip(poses.pose, numbers, elastic.ambiguous, strict=True):
        lines.append(",".join([str(pose), *(f"{v:.9f}" for v in row), "false" if ambiguous else "true"]))
    write_text(path, "\n".join(lines) + "\n")
