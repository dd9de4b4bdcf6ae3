"""What `flexcal filter --json` says of a program whose names look like markup."""

from __future__ import annotations

from typing import Any

import numpy as np

HOSTILE = "<script>alert('P')</script><b>&amp;"


def target(order: int, at: list[float], shift: list[float], name: str = "P[1]") -> dict[str, Any]:
    return {
        "order": order,
        "file": "weld.ls",
        "line": 10 + order,
        "name": name,
        "motion": "L",
        "kind": "pose",
        "before": [1.0, 2.0, 3.0, 0.0, 90.0, 0.0],
        "after": [1.25, 2.0, 3.0000004, 0.0, 90.001, -0.0000001],
        "nominal_xyz_m": at,
        "corrected_xyz_m": (np.array(at) + shift).tolist(),
        "shift_mm": float(np.linalg.norm(shift)) * 1e3,
        "turn_deg": 0.031,
    }


def program_results(left: bool = True) -> dict[str, Any]:
    """What `flexcal filter --json` says of three targets, the second of which stays, and of one that is computed."""
    stays = [
        {"order": 1, "file": "weld.ls", "line": 11, "text": HOSTILE, "reason": f"{HOSTILE} is out of reach"},
        {"order": None, "file": "weld.ls", "line": 30, "text": "L PR[1]", "reason": "a register"},
    ]
    return {
        "program": ["weld.ls"],
        "units": "mm and °",
        "reversed": False,
        "targets": [
            target(0, [0.5, 0.0, 0.3], [3e-4, 0.0, 4e-4]),
            target(2, [0.5, 0.1, 0.3], [0.0, 0.0, -1e-4], HOSTILE),
        ],
        "left": stays if left else [],
        "remarks": [HOSTILE] if left else [],
        "provenance": {"input.weld.ls": "0123"},
        "command": "flexcal filter robot.yaml weld.ls --report page.html",
    }
