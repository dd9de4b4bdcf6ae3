"""Comparison of two folders of the same verb."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexcal.data.poses import DEFAULT_SIGMA
from flexcal.errors import InputError
from flexcal.files.formats import read_estimates
from flexcal.files.transaction import real_path
from flexcal.jobs.pages.changed_robot import geometry_change
from flexcal.jobs.pages.report import missing_key_error
from flexcal.jobs.result_files import (
    DESCRIPTIONS,
    ESTIMATES,
    RESULTS,
    VERIFICATION,
    read_points,
    read_results,
    read_verification,
)
from flexcal.report.layout import write_page
from flexcal.report.pages import comparison_page
from flexcal.report.results import Comparison, Run
from flexcal.report.sections import common_origin

COMPARISON = "comparison.html"


def compare_folders(first: Path, second: Path, robot: Path | None = None) -> dict[str, Any]:
    """Write comparison.html into the folder `first`, and return its numbers; as `folder_comparison`."""
    comparison = folder_comparison(first, second, robot)
    write_page(first / COMPARISON, comparison_page(comparison))
    return comparison.document()


def folder_comparison(first: Path, second: Path, robot: Path | None = None) -> Comparison:
    """Comparison of two folders: errors, parameters, and where both are calibrations, how the robot changed.

    `robot` is the robot.yaml of both, by default one that is found in or above the folders, or in the working folder.

    Raises `InputError` where one holds no calibration, verification or demo, they are of different kinds or robots, or both are the same.
    """
    if real_path(first) == real_path(second):
        raise InputError("E-REPORT-001", f"{first} and {second} are the same folder; give two.")
    names = _names(first, second)
    one, two = _run(first, names[0]), _run(second, names[1])
    if one.kind != two.kind:
        raise InputError(
            "E-REPORT-002", f"{first} is a {one.kind}, {second} a {two.kind}; compare two of the same kind."
        )
    if one.robot != two.robot or one.q.shape[1] != two.q.shape[1]:
        raise InputError(
            "E-REPORT-003",
            f"{first} is of the robot '{one.robot}', {second} of '{two.robot}'; compare two runs of one robot.",
        )
    change, why = geometry_change(first, second, one, two, robot)
    return Comparison(one, two, change, why)


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Names of the folders, with as much of the path as distinguishes them."""
    parts = [real_path(path).parts for path in (first, second)]
    for depth in range(1, max(len(p) for p in parts) + 1):
        one, two = ("/".join(p[-depth:]) for p in parts)
        if one != two:
            return one, two
    raise InputError("E-REPORT-004", f"{first} and {second} are the same folder; give two.")


def _run(folder: Path, name: str) -> Run:
    try:
        return _left(folder, name)
    except KeyError as problem:
        raise missing_key_error(folder, problem) from problem


def _left(folder: Path, name: str) -> Run:
    if not (folder / RESULTS).is_file():
        raise InputError(
            "E-REPORT-005",
            f"{folder} holds no {RESULTS}; give a folder that calibrate, verify or demo wrote with --out.",
        )
    results = read_results(folder)
    path = folder / ESTIMATES
    estimates = read_estimates(path) if path.is_file() else {}
    origin: dict[str, str] = {"command": results.get("command", "")}
    if results["kind"] in ("verification", "calibration"):
        points = read_points(folder, sigma=DEFAULT_SIGMA)
        verified = results["kind"] == "verification"
        origins = results["provenance"] if verified else common_origin(estimates)
        return Run(
            name=name,
            kind="verification" if verified else "calibration",
            robot=results["robot"],
            q=points.poses.q,
            points=points.poses.position,
            errors=points.calibrated,
            fresh=verified and not results["fitted"],
            before=points.before,
            estimates=estimates,
            data=_data(origins),
            origin=origin | origins,
        )
    if results["kind"] == "demo" and (folder / VERIFICATION).is_file():
        origins = common_origin(estimates)
        fresh, _ = read_verification(folder / VERIFICATION)
        return Run(
            name=name,
            kind="demo",
            robot=results["robot"],
            q=fresh.poses.q,
            points=fresh.poses.position,
            errors=fresh.calibrated,
            fresh=True,
            before=fresh.before,
            estimates=estimates,
            data=_data(origins),
            origin=origin | origins,
        )
    raise InputError(
        "E-REPORT-006", f"{folder} is no folder of calibrate, verify or demo; only these can be compared."
    )


def _data(origin: Mapping[str, str]) -> dict[str, str]:
    """Digests of the measurements and blocks used, by name."""
    return {
        key.partition(".")[2]: value
        for key, value in origin.items()
        if key.startswith("block.")
        or (key.startswith("input.") and not key.split(" (")[0].endswith(DESCRIPTIONS))
    }
