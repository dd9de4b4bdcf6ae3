"""Block `signals:` of a robot.yaml."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexcal.errors import InputError
from flexcal.files.formats import read_yaml_file
from flexcal.files.transaction import read_text, write_text
from flexcal.model.robot import RobotModel


def signals_text(signals: Mapping[str, Mapping[str, Any]]) -> str:
    """Block as YAML text."""
    lines = ["signals:"]
    for quantity, entry in signals.items():
        parts = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in entry.items()]
        lines.append(f"  {quantity}: {{{', '.join(parts)}}}")
    return "\n".join(lines) + "\n"


def add_signals(robot_file: Path, signals: Mapping[str, Mapping[str, Any]]) -> None:
    """Append the block to robot.yaml, every byte before it kept.

    Raises `InputError` where there is one already that says something else, and gives the lines to put there by hand.
    """
    declared = read_yaml_file(robot_file).data.get("signals")
    block = signals_text(signals)
    if declared is not None:
        if all(declared.get(quantity) == dict(entry) for quantity, entry in signals.items()):
            return
        raise InputError(
            "E-RUN-092", f"{robot_file} has `signals:` already, which is not changed; replace it by: {block}"
        )
    text = read_text(robot_file)
    write_text(robot_file, f"{text}{'' if text.endswith(chr(10)) else chr(10)}\n{block}")
    try:
        RobotModel.from_yaml(robot_file, estimates=False)
    except BaseException:
        write_text(robot_file, text)
        raise
