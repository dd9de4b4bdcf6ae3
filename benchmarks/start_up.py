"""What importing and asking for help cost over a bare interpreter (limits: 0.3 s and 0.5 s)."""

from __future__ import annotations

import subprocess
import sys
import time

RUNS = 7


def run() -> list[tuple[str, float, str]]:
    """Limit over time spent."""
    bare = _seconds([sys.executable, "-c", "pass"])
    imported = _seconds([sys.executable, "-c", "from flexcal import RobotModel"]) - bare
    helped = _seconds([sys.executable, "-m", "flexcal.cli.main", "--help"])
    return [
        (
            "from flexcal import RobotModel, limit 0.3 s",
            0.3 / imported,
            f"{imported:.3f} s over a bare interpreter",
        ),
        ("flexcal --help, limit 0.5 s", 0.5 / helped, f"{helped:.3f} s"),
    ]


def _seconds(command: list[str]) -> float:
    def once() -> float:
        started = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        return time.perf_counter() - started

    return sorted(once() for _ in range(RUNS))[RUNS // 2]
