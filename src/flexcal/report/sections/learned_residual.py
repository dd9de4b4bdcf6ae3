"""Reduction of the torque error by a learned residual torque."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from flexcal.report.layout import Section, Table, Text, significant


def learned_section(learned: Mapping[str, Any], held_out: str) -> Section:
    """Errors with and without it, by motor in left-out blocks of the fit and by joint; `held_out` says what the fit never saw, if
    anything."""
    file, error = learned["file"], learned["error_percent"]
    where = held_out or "the recordings of the fit"
    shown = error["held_out"] or error["train"]
    verdict = (
        f"Stored in {PurePath(file).name}. With it, the relative torque error of {where} is {significant(shown['with'], 3)} % instead of "
        f"{significant(shown['without'], 3)} %."
        if file
        else "No residual model was kept: it reduced the cross-validation error of no motor."
    )
    motors = [
        (
            row["motor"],
            *(significant(row["cross_validation_percent"][key], 3) for key in ("without", "with")),
            "learned" if row["learned"] else "no gain",
        )
        for row in learned["motors"]
    ]
    joints = [
        (
            joint,
            *(significant(row[key], 3) for key in ("without", "with")),
            significant(row["inside_interval_percent"], 3),
        )
        for joint, row in learned["per_joint"].items()
    ]
    return Section(
        "learned",
        "Learned residual torque",
        "Residual torque of the physical model as a function of position, speed and predicted torque of each motor. It is added to "
        "predicted "
        "torques only: every parameter and interval on this page is as it would be without.",
        (
            Text((verdict,)),
            Table(
                "table-learned-motors",
                "Relative torque errors of the motors in cross-validation",
                ("motor", "without / %", "with / %", "verdict"),
                tuple(motors),
                "Each block is predicted from physical parameters and residuals of the others alone. The error has to fall by 1 %.",
                text_columns=(3,),
            ),
            Table(
                "table-learned-joints",
                f"Relative torque errors of the joints, {where}",
                ("joint", "without / %", "with / %", "inside 95 % interval / % of rows"),
                tuple(joints),
            ),
        ),
    )
