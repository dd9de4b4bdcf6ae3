"""Honesty under a wrong model: with one mismatch of the cell on, either χ² or drift is flagged or the intervals still cover.

`python -m benchmarks.mismatch --first 2000 --count 4`
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

import argparse
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks._tasks import in_parallel
from flexcal.calibration.diagnostics import Drift
from flexcal.jobs.two_stage import run_two_stage

EXAMPLE = Path(__file__).parent.parent / "examples" / "tx90l"
MISMATCHES = {
    "none": "",
    "drives 20 % stiffer at 1 mrad": "cubic_stiffness: 0.2",
    "hysteresis of 0.02 mrad": "hysteresis: 2.0e-5",
    "wrist of 50 kN m/rad": "elastic_wrist: 5.0e+4",
    "repeatability 35 µm": "repeatability: 35.0e-6",
    "drift of 0.1 mm": "temperature_drift: 1.0e-4",
}


@dataclass(frozen=True)
class Outcome:
    """What one hidden truth gave: χ² per degree of freedom by stage, what the fit complains of, normalised errors."""

    chi2: tuple[float, float]
    flags: tuple[str, ...]
    springs: tuple[float, ...]
    geometry: tuple[float, ...]


def one(case: tuple[str, int]) -> Outcome:
    """The demonstration with one mismatch and seed."""
    label, seed = case
    with tempfile.TemporaryDirectory() as folder:
        robot = Path(folder) / "robot"
        shutil.copytree(EXAMPLE, robot)
        lines = [
            line
            for line in (robot / "cell.yaml").read_text().splitlines()
            if not line.startswith("mismatch:")
        ]
        (robot / "cell.yaml").write_text("\n".join([*lines, f"mismatch: {{{MISMATCHES[label]}}}", ""]))
        study = run_two_stage(robot / "robot.yaml", Path(folder) / "out", seed=seed, report=False)
    springs, geometry, truth = study.stiffness.estimate, study.calibration.estimate, study.truth or {}
    z = []
    for name in (name for name in study.stiffness.springs if name in truth):
        k = springs.parameters.index(name)
        if springs.identifiable[k]:
            z.append(float(np.log(springs.values[name] / truth[name]) / np.sqrt(springs.covariance[k, k])))
    expected = geometry.regrouped(truth)
    kept = study.calibration.identifiability.kept_names
    w = [(geometry.values[n] - expected[n]) / (geometry.std(n) or np.inf) for n in kept]
    complaints = {
        "stage 1": springs.unexplained,
        "stage 2": geometry.unexplained,
        "drift": Drift.of(study.calibration).certain,
    }
    flags = tuple(name for name, raised in complaints.items() if raised)
    return Outcome((springs.reduced_chi2, geometry.reduced_chi2), flags, tuple(z), tuple(w))


def run() -> list[tuple[str, float, str]]:
    """Share of intervals that contain the truth over the promised 0.95, with the χ² beside it."""
    return list(collect(range(2000, 2002)))


def collect(seeds: range) -> Iterator[tuple[str, float, str]]:
    """All mismatches on all seeds, one process a core."""
    cases = [(label, seed) for label in MISMATCHES for seed in seeds]
    outcomes = in_parallel(one, cases)
    for label in MISMATCHES:
        rows = [row for (own, _), row in zip(cases, outcomes, strict=True) if own == label]
        springs = np.abs([z for row in rows for z in row.springs])
        geometry = np.abs([w for row in rows for w in row.geometry])
        first, second = np.mean([row.chi2 for row in rows], axis=0)
        named = {flag: sum(flag in row.flags for row in rows) for flag in ("stage 1", "stage 2", "drift")}
        note = (
            f"χ² stage 1 {first:.2f}, stage 2 {second:.2f}; flagged {sum(bool(row.flags) for row in rows)}/{len(rows)} "
            f"({', '.join(f'{flag} {count}' for flag, count in named.items())}); "
            f"inside: springs {100 * np.mean(springs < 1.96):.0f} %, geometry {100 * np.mean(geometry < 1.96):.0f} %"
        )
        yield label, float(np.mean(np.concatenate([springs, geometry]) < 1.96)) / 0.95, note


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=2000)
    parser.add_argument("--count", type=int, default=4)
    given = parser.parse_args()
    for label, ratio, note in collect(range(given.first, given.first + given.count)):
        print(f"{label:32s} {ratio:6.2f}   {note}", flush=True)
