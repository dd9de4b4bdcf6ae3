"""Recordings of played signals in a folder, as a cell: found by their torques, put on the plan's samples, and named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexcal.data.experiments import PLAN, existing_file, labels, require_measurements, require_same_plan
from flexcal.data.plans import MultisinePlan, TrajectoryPlan, read_plan_of
from flexcal.data.recordings import FILL, Recording, RecordingLabel, read_recording
from flexcal.data.tables import open_table
from flexcal.errors import InputError
from flexcal.frequency.periodic import MotionSearch, Recognition, SignalSearch, nearest_poses, on_plan
from flexcal.jobs.experiments.excitation_export import MANIFEST, MOVES, PHASES
from flexcal.model.robot import RobotModel

_Find = Callable[[Recording, Path], Recognition]
_SLOWER = 0.9
"""Rate of a log relative to the plan's below which it may be that of the controller."""
_SEVERAL, _MOSTLY = 2, 0.3
"""Number and share of logs with another's name up to which they were exchanged by mistake."""
_TEXTS = ("file", "sha256")
"""Columns of the manifest that are no numbers."""
_SHOWN = 5
"""Recordings that a message lists."""


class PlayedRecordings:
    """Cell of the joint logs (CSV, Parquet) in a folder, recorded while the signals of a frequency plan, or trajectories, were played.

    Names do not matter: a trajectory is told from positions; pose, realisation, experiment and sign of a signal from positions and torques,
    and only where two poses are as near as a soft controller sags does a standard name decide. Once all are read, `remarks` say what was
    exchanged or drifts, and `found` has an entry a log.
    """

    def __init__(self, folder: Path, model: RobotModel) -> None:
        self.folder, self.model = folder, model
        self.remarks: list[str] = []
        self.found: list[dict[str, Any]] = []

    def record(self, plan: MultisinePlan | TrajectoryPlan) -> Iterator[Recording]:
        """The recordings one by one, in the order of the file names, labelled.

        Raises `InputError` where a log is none of the plan, or two are the same; and, after the last, where one is missing, or many hold
        another signal than their names say.
        """
        expected = {label.name: label for label in labels(plan)}
        find = self._motions(plan) if isinstance(plan, TrajectoryPlan) else self._signals(plan, expected)
        fill = FILL if isinstance(plan, TrajectoryPlan) else 0.0
        found: dict[RecordingLabel, Path] = {}
        renamed: list[str] = []
        for file in self._files():
            recording = read_recording(file, self.model, fill=fill)
            recognised, named = find(recording, file), expected.get(file.stem)
            label = recognised.label
            if label in found:
                raise InputError(
                    "E-EXP-018",
                    f"{file} and {found[label].name} are both recordings of {label.name}; remove one of them, or record again what the "
                    "other should be.",
                )
            found[label] = file
            if named is not None and named != label:
                renamed.append(f"{file.name} is {label.name}")
            self.found.append(
                {
                    "file": file,
                    "recording": label.name,
                    "start_s": recognised.start - recording.start,
                    "rate_hz": 1 / recording.time_step,
                    "clock_ppm": 1e6 * (recognised.clock - 1),
                    "correlation": recognised.correlation,
                }
            )
            yield on_plan(plan, recording, recognised)
        missing = [name for name, label in expected.items() if label not in found]
        if missing:
            raise InputError(
                "E-EXP-019",
                f"{self.folder}: {len(missing)} of {len(expected)} recordings of the plan are missing: {_listed(missing)}; play and record "
                f"{'it' if len(missing) == 1 else 'them'}.",
            )
        known = sum(Path(entry["file"]).stem in expected for entry in self.found)
        if len(renamed) > max(_SEVERAL, _MOSTLY * known):
            raise InputError(
                "E-EXP-028",
                f"{self.folder}: {len(renamed)} of {known} logs hold another signal than their names say ({_listed(renamed)}), as where a "
                "column of tau has the wrong sign or is another joint's; correct it under `signals:`, or give names that say nothing.",
            )
        if renamed:
            self.remarks.append(f"logs are taken as what they hold, not by their names: {_listed(renamed)}")
        slowest = min(entry["rate_hz"] for entry in self.found)
        if isinstance(plan, MultisinePlan) and plan.torque == "held" and slowest < _SLOWER * plan.rate_hz:
            self.remarks.append(
                f"logs have {slowest:.6g} samples a second, and torques are taken as held for 1/{plan.rate_hz:.6g} s, as the plan has it; "
                "if the signals were played at another rate, give the plan.yaml beside them"
            )
        drifts = [abs(entry["clock_ppm"]) for entry in self.found if entry["clock_ppm"]]
        if drifts:
            self.remarks.append(
                f"the clock of {len(drifts)} logs differs from the controller's, by up to {max(drifts):.3g} in a million: corrected"
            )

    def _signals(self, plan: MultisinePlan, expected: dict[str, RecordingLabel]) -> _Find:
        search = SignalSearch(plan)

        def find(recording: Recording, file: Path) -> Recognition:
            poses, named = nearest_poses(plan, recording), expected.get(file.stem)
            if named is not None and named.pose in poses:
                poses.insert(0, named.pose)
            return search.find(recording, poses)

        return find

    def _motions(self, plan: TrajectoryPlan) -> _Find:
        search = MotionSearch(plan)
        return lambda recording, file: search.find(recording)

    def _files(self) -> list[Path]:
        """The logs, by name; raises `InputError` where there are none, or one is there in both formats."""
        others = {MANIFEST, MOVES, PHASES}
        files = [
            path
            for path in sorted(self.folder.iterdir())
            if path.suffix in (".csv", ".parquet") and path.name not in others and path.is_file()
        ]
        if not files:
            raise InputError(
                "E-EXP-020",
                f"{self.folder} holds no joint logs (.csv or .parquet); give the folder with the recordings, or 'virtual'.",
            )
        return [existing_file(self.folder, file.stem) for file in files]


def _listed(names: list[str]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")


def plan_as_played(folder: Path, plan: MultisinePlan | TrajectoryPlan) -> MultisinePlan | TrajectoryPlan:
    """The plan in `folder`, by which signals were exported, where there is one, else `plan`; rate, amplitudes and gains may differ.

    Of a manifest.csv there, the rate is taken.

    Raises `InputError` where `folder` is none, or its plan differs otherwise.
    """
    require_measurements(folder)
    if not (folder / PLAN).is_file():
        if isinstance(plan, TrajectoryPlan) or not (folder / MANIFEST).is_file():
            return plan
        table = open_table(folder / MANIFEST)
        if "rate_hz" not in table.columns:
            raise table.error(
                "E-EXP-029",
                "the column 'rate_hz' is missing; copy the file that 'flexcal export excitation' wrote.",
            )
        return replace(plan, rate_hz=float(table.read(_TEXTS).columns["rate_hz"][0]))
    played: MultisinePlan | TrajectoryPlan
    if isinstance(plan, TrajectoryPlan):
        played, free = read_plan_of(folder / PLAN, TrajectoryPlan), ()
    else:
        played, free = read_plan_of(folder / PLAN, MultisinePlan), ("rate_hz", "amplitude", "kp", "kd")
    require_same_plan(folder / PLAN, played, plan, free=("name", *free))
    return played
