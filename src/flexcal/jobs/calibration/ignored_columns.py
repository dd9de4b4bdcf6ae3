"""Remarks on columns of pose files that are not used."""

from __future__ import annotations

from collections.abc import Collection

from flexcal.data.poses import PoseSet


def ignored_columns_remarks(poses: PoseSet, used: Collection[str] = ()) -> tuple[str, ...]:
    """Remarks on quantities that are present without effect, one sentence each; `used` are those that have one."""
    remarks = []
    if poses.torque is not None:
        remarks.append(
            "the torques tau1… in the files are not used: they contain friction, so the flank of a backlash is computed from the model"
        )
    if poses.temperature is not None and "temperature" not in used:
        remarks.append(
            "the temperature in the files is not used: no selected term of the model depends on it"
        )
    if poses.time is not None and "time" not in used:
        remarks.append("no term of the model depends on the times in the files")
    return tuple(remarks)
