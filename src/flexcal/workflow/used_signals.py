"""Treatment of logs in results.json and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.dynamics import JointLog
from flexcal.workflow.treatment import Treatment


def used_signals(treatment: Treatment, logs: Sequence[JointLog]) -> dict[str, Any]:
    """The entry `signals` of results.json: filters, and what was done with the time stamps of each log where they are not uniform."""
    return {
        "cutoff_hz": treatment.cutoff_hz,
        "decimation": treatment.decimation.factor,
        "proposed": list(treatment.proposed),
        "cross_validation": None
        if treatment.choice is None
        else {
            "error_percent": 100 * treatment.choice.error,
            "error_of_spectrum_percent": 100 * treatment.choice.proposed_error,
        },
        "time_stamps": {str(log.path): log.time_stamps for log in logs if log.time_stamps},
    }


def signal_sentences(signals: Mapping[str, Any]) -> list[str]:
    """The same in words: what was proposed and from what, and the treatment of time stamps."""
    said = []
    if signals["proposed"]:
        tried = signals["cross_validation"]
        source = "the spectrum of the motion" if tried is None else "the torques of left-out blocks"
        said.append(
            f"proposed from {source}, because robot.yaml lacks {' and '.join(signals['proposed'])}: "
            f"'dynamics: {{cutoff_hz: {signals['cutoff_hz']:g}, decimation: {signals['decimation']}}}'"
        )
        if tried is not None:
            said.append(
                f"with ten times the bandwidth of the positions as cut-off, which noise increases, the error in left-out blocks would be "
                f"{tried['error_of_spectrum_percent']:.1f} % instead of {tried['error_percent']:.1f} %"
            )
    return said + [f"{log}: {words}" for log, words in signals["time_stamps"].items()]
