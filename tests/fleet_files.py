"""Files of a fleet as its verbs leave them, written here by other means: text for YAML, the json and zipped arrays of the libraries."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

URDF = """<robot name="{name}">
  <link name="base"/><link name="arm"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""
UNITS = {"offset": "rad", "misalignment_1": "rad", "length_x": "m", "x": "m"}


def write_robot(
    folder: Path, *, model: str = "scara", serial: str | None = None, tolerance: float | None = None
) -> str:
    """robot.yaml and URDF of a robot; the SHA-256 of the URDF."""
    folder.mkdir(parents=True, exist_ok=True)
    text = URDF.format(name=model)
    (folder / "arm.urdf").write_text(text, "utf-8")
    lines = ["robot: arm.urdf"]
    if serial is not None:
        lines.append(f'serial: "{serial}"')
    if tolerance is not None:
        lines.append(f"tolerance: {tolerance}")
    (folder / "robot.yaml").write_text("\n".join(lines) + "\n", "utf-8")
    return hashlib.sha256(text.encode()).hexdigest()


def write_calibration(
    folder: Path,
    values: Mapping[str, tuple[float, float]],
    *,
    data: str,
    dropped: Mapping[str, Mapping[str, float]] | None = None,
    terms: str = "kinematic",
    urdf: str = "0",
    prior_std: float | None = None,
) -> None:
    """estimates.yaml and estimates.npz with a block `calibration`: value and standard deviation by name; `data` stands for the poses."""
    folder.mkdir(parents=True, exist_ok=True)
    names = list(values)
    covariance = np.diag([std**2 for _, std in values.values()])
    held = dropped or {}
    lines = ["calibration:", "  values:"]
    prior = "" if prior_std is None else f", prior_std: {prior_std!r}"
    for name, (value, std) in values.items():
        unit = UNITS[name.rpartition(".")[2]]
        if name in held:
            lines.append(
                f"    {name}: {{estimate: {value!r}, unit: {unit}, identifiable: false, scale: linear}}"
            )
        else:
            lines.append(
                f"    {name}: {{estimate: {value!r}, unit: {unit}, std: {std!r}, low: {value - 2 * std!r}, "
                f"high: {value + 2 * std!r}, identifiable: true, scale: linear{prior}}}"
            )
    if held:
        lines.append("  dropped:")
        lines += [f"  - {{name: {name}, absorbed_by: {json.dumps(dict(by))}}}" for name, by in held.items()]
    sha = hashlib.sha256(covariance.astype("<f8").tobytes()).hexdigest()
    lines += [
        "  fit: {rank: 2, cost: 1.0, chi2: 100.0, degrees_of_freedom: 100, status: converged, message: '', iterations: 3}",
        f'  covariance_sha256: "{sha}"',
        f'  provenance: {{program: test, input.arm.urdf: "{urdf}", input.poses.csv: "{_digest(data)}", option.terms: {terms}}}',
    ]
    (folder / "estimates.yaml").write_text("\n".join(lines) + "\n", "utf-8")
    np.savez(
        folder / "estimates.npz",
        **{"calibration.names": np.array(names), "calibration.covariance": covariance},
    )


def write_verification(
    folder: Path,
    p90_mm: float,
    *,
    data: str,
    calibration: str = "c",
    poses: int = 40,
    freedom: float | None = None,
    fitted: bool = False,
    moved: bool = False,
) -> None:
    """results.json of a verification with this P90, mm; `calibration` stands for the block that it verified."""
    folder.mkdir(parents=True, exist_ok=True)
    errors = {"poses": poses, "mean_mm": 0.64 * p90_mm, "p90_mm": p90_mm, "max_mm": 1.3 * p90_mm}
    document = {
        "kind": "verification",
        "schema": 1,
        "robot": "scara",
        "before": {"declared": None, "registered": errors, "own": None},
        "verification": {"measured": errors},
        "rms_mm": {"parameters": 0.1, "expected": 0.7 * p90_mm, "measured": 0.7 * p90_mm},
        "prediction": None if freedom is None else {"freedom": freedom},
        "refit_proposed": {"what": ["station"]} if moved else None,
        "fitted": ["poses.csv"] if fitted else [],
        "verdict": {"trusted": True, "reasons": []},
        "provenance": {
            "program": "test",
            "input.others.csv": _digest(data),
            "block.calibration": _digest(calibration),
        },
    }
    (folder / "results.json").write_text(json.dumps(document), "utf-8")


def write_visits_of_recheck(folder: Path, visits: Sequence[tuple[str, float]], *, limit: float) -> None:
    """visits.json of a recheck: day and p-value; a joint is said to have shifted where that is below the `limit`."""
    folder.mkdir(parents=True, exist_ok=True)
    empty: dict[str, list[float]] = {"pose": [], "target": [], "station": [], "q": [], "position": []}
    document = {
        "kind": "visits",
        "schema": 1,
        "robot": "scara",
        "visits": [
            {
                "date": day,
                "files": {"1. visit.csv": _digest(f"{folder} {day}")},
                "calibration": _digest("c"),
                "reference": k == 0,
                "verdict": "joint_shifted" if p < limit else "as_calibrated",
                "sentence": "j2 shifted by +0.2 mrad" if p < limit else "as calibrated",
                "probability": p,
                "shifts": [
                    {"subject": "j2", "estimate": 2e-4, "std": 4e-5, "common_std": 3e-5, "series": "s"}
                ],
                "readings": {**empty, "sigma": None, "payload": None},
                "alarms": [],
                "suspects": [],
            }
            for k, (day, p) in enumerate(visits)
        ],
    }
    (folder / "visits.json").write_text(json.dumps(document), "utf-8")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
