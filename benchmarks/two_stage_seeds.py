"""The whole demonstration on many hidden truths: how large the errors are, and whether the intervals tell the truth about them.

`python -m benchmarks.two_stage_seeds --first 1000 --count 20 [--plan designed] [--inertias-known] [--half-gap 1.5e-4]`
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from benchmarks._tasks import in_parallel
from flexcal.design.frequency import PlannedResponses
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ExperimentEffect,
    ModelError,
    ResponseModel,
    ResponseResidual,
    Tolerances,
)
from flexcal.files.formats import read_yaml
from flexcal.jobs.experiments import PlanName, response_sensors
from flexcal.jobs.two_stage import TwoStageRun, run_two_stage
from flexcal.model.robot import RobotModel, spring_names, unit_of
from flexcal.virtual_cell import CellConfig, draw_truth, write_truth

ROBOT = Path(__file__).parent.parent / "examples" / "tx90l" / "robot.yaml"


def one_seed(seed: int, plan: PlanName, inertias_known: bool, half_gap: float | None) -> dict[str, Any]:
    """Run one hidden truth and keep the numbers."""
    with tempfile.TemporaryDirectory() as folder:
        truth = None
        if half_gap is not None:
            nominal = RobotModel.from_yaml(ROBOT, estimates=False)
            spread = read_yaml(ROBOT.parent / "cell.yaml", CellConfig).spread
            values = draw_truth(nominal, spread, np.random.default_rng([seed, 0]))
            values |= {name: half_gap for name in values if name.endswith(".backlash")}
            truth = Path(folder) / "given.yaml"
            write_truth(truth, values)
        run = run_two_stage(
            ROBOT,
            Path(folder) / "out",
            seed=seed,
            plan=plan,
            truth=truth,
            inertias_known=inertias_known,
            report=False,
        )
    return {
        "seed": seed,
        "springs": _springs(run),
        "inertials": _inertials(run),
        "geometry": _geometry(run),
        "predicted": _predicted(run),
        "results": run.results,
    }


def _predicted(run: TwoStageRun) -> float:
    """Largest standard deviation of a stiffness that is predicted for the plan, from what was known before it was carried out."""
    planned = PlannedResponses.of(run.informed, run.plan, response_sensors(ROBOT))
    return max(std for name, std in planned.std().items() if name.endswith(".stiffness"))


def _springs(run: TwoStageRun) -> dict[str, dict[str, Any]]:
    """Relative error, and error over standard deviation in the logarithm, of every spring parameter."""
    estimate, truth = run.stiffness.estimate, run.truth
    found, bounds = {}, cramer_rao(run)
    for name in spring_names(run.nominal):
        k = estimate.parameters.index(name)
        error = float(np.log(estimate.values[name] / truth[name]))
        found[name] = {
            "relative": estimate.values[name] / truth[name] - 1,
            "std": float(np.sqrt(estimate.covariance[k, k])),
            "over_bound": float(np.sqrt(estimate.covariance[k, k]) / bounds[k]),
            "normalised": error / float(np.sqrt(estimate.covariance[k, k])),
            "identifiable": estimate.identifiable[k],
        }
    return found


def _inertials(run: TwoStageRun) -> dict[str, Any]:
    """Error over standard deviation of everything that stage 0 found, and the mean square of all together, decorrelated."""
    found = run.dynamics
    if found is None:
        return {"normalised": [], "joint": float("nan")}
    truth = {n: run.truth.get(n, run.nominal.value(n)) for n in found.parameters.names}
    error = found.parameters.coordinates() - found.parameters.coordinates(truth)
    return {
        "normalised": list(error / np.sqrt(np.diag(found.covariance))),
        "joint": float(error @ np.linalg.solve(found.covariance, error)) / len(error),
    }


def cramer_rao(run: TwoStageRun) -> np.ndarray:
    """Standard deviations (p,) of stage 1 that noise, distortion and the priors of inertias and geometry allow."""
    estimate, responses = run.stiffness.estimate, run.responses
    x = estimate.parameters.coordinates()
    model = ResponseModel.of(run.informed, responses, estimate.parameters).with_loaded_drives(x, run.plan)
    residual = ResponseResidual.of(model, responses, CovarianceWeighting())
    geometry = replace(Tolerances.none(), length=Tolerances.length, angle=Tolerances.angle)
    still = [ExperimentEffect.none(response) for response in responses]
    jacobian = ModelError.of(residual, responses, x, still, geometry).whiten(residual.linearise(x)[1])
    prior = run.informed.posterior.prior(estimate.parameters)[1]
    information = jacobian.T @ jacobian + np.linalg.inv(prior)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def _geometry(run: TwoStageRun) -> list[float]:
    """Error over standard deviation of every kept geometric parameter against the regrouped truth."""
    estimate = run.calibration.estimate
    expected = estimate.regrouped(run.truth)
    names = [n for n in run.calibration.identifiability.kept_names if unit_of(n) in ("m", "rad")]
    return [(estimate.values[n] - expected[n]) / (estimate.std(n) or np.inf) for n in names]


def summary(runs: list[dict[str, Any]]) -> str:
    """The numbers of all runs as a text table."""
    names = list(runs[0]["springs"])
    stiff = [n for n in names if n.endswith("stiffness")]
    lines = [f"{len(runs)} seeds {runs[0]['seed']}..{runs[-1]['seed']}"]
    worst = [max(abs(r["springs"][n]["relative"]) for n in stiff) for r in runs]
    lines.append(
        f"largest of nine stiffness errors: median {100 * np.median(worst):.2f} %, worst {100 * max(worst):.2f} %"
    )
    lines.append(
        f"{'parameter':32s} {'median |error|':>15s} {'worst':>9s} {'median std':>11s} {'identifiable':>13s}"
    )
    for name in names:
        rows = [r["springs"][name] for r in runs]
        error = np.abs([row["relative"] for row in rows])
        known = sum(row["identifiable"] for row in rows)
        lines.append(
            f"{name:32s} {100 * np.median(error):13.2f} % {100 * error.max():7.1f} % "
            f"{100 * np.median([row['std'] for row in rows]):9.2f} % {known:8d}/{len(rows)}"
        )
    predicted = [r["predicted"] for r in runs]
    lines.append(
        f"largest predicted standard deviation of a stiffness: median {100 * np.median(predicted):.2f} %, "
        f"worst {100 * max(predicted):.2f} %"
    )
    if runs[0]["results"]["cad_alone"] is not None:
        lines.append(_cad_alone(runs))
    for label, z in (
        ("stage 0", [z for r in runs for z in r["inertials"]["normalised"]]),
        ("springs", [q["normalised"] for r in runs for q in r["springs"].values() if q["identifiable"]]),
        ("geometry", [z for r in runs for z in r["geometry"]]),
    ):
        if not z:
            continue
        inside = np.mean(np.abs(z) < 1.96)
        lines.append(
            f"{label}: {len(z)} pairs, {100 * inside:.1f} % inside, mean normalised square {np.mean(np.square(z)):.2f}"
        )
    ratios = [q["over_bound"] for r in runs for q in r["springs"].values() if q["identifiable"]]
    lines.append(f"standard deviation over its Cramér-Rao bound: median {np.median(ratios):.2f}")
    for key in ("rank",):
        lines.append(f"{key}: {sorted({r['results']['identifiability'][key] for r in runs})}")
    lines.append(
        f"wrong flanks in calibration: {sum(r['results']['calibration_fit']['wrong_flanks'] for r in runs)}"
    )
    lines.append(f"{'mm':28s} {'mean':>17s} {'p90':>17s} {'max':>17s}   (median over seeds, worst seed)")
    blocks = {"calibration": [r["results"]["calibration"] for r in runs]}
    for key in ("elastic", "elastic_unambiguous", "measured", "floor", "rigid_40", "rigid_100", "nominal"):
        blocks[key] = [r["results"]["verification"][key] for r in runs]
    for label, rows in blocks.items():
        cells = []
        for key in ("mean_mm", "p90_mm", "max_mm"):
            values = [row[key] for row in rows]
            cells.append(f"{np.median(values):8.4f} {max(values):8.4f}")
        lines.append(f"{label:28s} " + " ".join(cells))
    seconds = [r["results"]["seconds"]["total"] for r in runs]
    lines.append(f"seconds a seed: median {np.median(seconds):.0f}")
    return "\n".join(lines)


def _cad_alone(runs: list[dict[str, Any]]) -> str:
    """Both stages fitted to the same data without stage 0."""
    alone = [r["results"]["cad_alone"] for r in runs]
    worst = [
        max(
            abs(q["estimate"] / q["truth"] - 1) for j in a["stage1"]["stiffness"].values() for q in j.values()
        )
        for a in alone
    ]
    p90, largest = (
        float(np.median([a["verification"]["elastic"][key] for a in alone])) for key in ("p90_mm", "max_mm")
    )
    joint = float(np.mean([r["inertials"]["joint"] for r in runs]))
    return (
        f"CAD alone: largest of nine median {100 * np.median(worst):.2f} %, worst {100 * max(worst):.2f} %; "
        f"verification p90 {p90:.4f}, max {largest:.4f} mm\nstage 0: mean square of all errors together, decorrelated: {joint:.2f}"
    )


def run() -> list[tuple[str, float, str]]:
    """The paper's 0.23 mm (p90, measured on a real robot) over ours on 20 hidden truths."""
    runs = collect(range(1000, 1020), "default", False, None)
    print(summary(runs))
    p90 = float(np.median([r["results"]["verification"]["elastic"]["p90_mm"] for r in runs]))
    return [("p90 of the verification, paper over ours", 0.23 / p90, f"{p90:.4f} mm")]


def collect(
    seeds: range, plan: PlanName, inertias_known: bool, half_gap: float | None
) -> list[dict[str, Any]]:
    """All seeds, one process a core."""
    return in_parallel(one_seed, seeds, plan, inertias_known, half_gap)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--plan", choices=get_args(PlanName), default="default")
    parser.add_argument("--inertias-known", action="store_true")
    parser.add_argument("--half-gap", type=float)
    parser.add_argument("--save", type=Path)
    given = parser.parse_args()
    runs = collect(
        range(given.first, given.first + given.count), given.plan, given.inertias_known, given.half_gap
    )
    print(summary(runs))
    if given.save:
        given.save.write_text(json.dumps(runs))


if __name__ == "__main__":
    main()
