"""Spectra and mean positions of the recordings of one pose, accumulated while reading."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.errors import FlexcalError

Keep = Callable[[MultisinePlan, Recording], tuple[np.ndarray, ...]]
"""Function that reduces a recording to the mean position (n,) of all joints and the spectra (bins, columns) of a method."""


class PoseRecords:
    """Accumulator of the recordings of one pose of a plan; stores only the output of `keep`, so that any number fits in memory.

    The first row of a recording is the start of its experiment (excitation and reference at t = 0), whatever its clock.
    """

    def __init__(self, plan: MultisinePlan, pose: int, keep: Keep) -> None:
        self.plan = plan
        self.pose = pose
        self._keep = keep
        signs = (1, -1) if plan.signs else (1,)
        experiments = range(len(plan.joints))
        self._expected = [(r, e, s) for r in range(plan.realisations) for e in experiments for s in signs]
        self._kept: dict[tuple[int, int, int], tuple[np.ndarray, ...]] = {}
        self._time_step: float | None = None
        self._sensors: tuple[str, ...] | None = None

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the recorded sensors on the arm."""
        return self._sensors or ()

    @property
    def time_step(self) -> float:
        """Sample time (s) of the recordings."""
        if self._time_step is None:
            raise FlexcalError(
                "E-FRF-023", f"there is no recording of pose {self.pose + 1}; record it or name another pose."
            )
        return self._time_step

    @property
    def q_mean(self) -> np.ndarray:
        """Mean motor position (n,) rad over all recordings."""
        return np.mean([kept[0] for kept in self._kept.values()], axis=0)

    @property
    def complete(self) -> bool:
        """Whether all realisations, experiments and signs are present."""
        return len(self._kept) == len(self._expected)

    def check_complete(self) -> None:
        """Raise `FlexcalError` that names the first missing recording."""
        missing = [key for key in self._expected if key not in self._kept]
        if missing:
            first = RecordingLabel(self.pose, *missing[0])
            raise FlexcalError(
                "E-FRF-024",
                f"{len(missing)} of {len(self._expected)} recordings of pose {self.pose + 1} are missing, the first is "
                f"{first.name}; record them.",
            )

    def add(self, recording: Recording) -> None:
        """Add one recording; raises `FlexcalError` if it is a duplicate, too short, or of another sample time."""
        label = recording.label
        assert label is not None
        key = (label.realisation, label.experiment, label.sign)
        if key not in self._expected or key in self._kept:
            state = "is there twice" if key in self._kept else "is not in the plan"
            raise FlexcalError("E-FRF-025", f"{recording.name} {state}; remove it.")
        if self._time_step is None:
            self._time_step = recording.time_step
        elif abs(recording.time_step - self._time_step) > 1e-9 * self._time_step:
            raise FlexcalError(
                "E-FRF-026",
                f"{recording.name}: its sample time is {recording.time_step:g} s, but that of recordings before it is "
                f"{self._time_step:g} s; record them all at one rate.",
            )
        if self._sensors is None:
            self._sensors = recording.sensors
        elif recording.sensors != self._sensors:
            own, others = (" and ".join(names) or "none" for names in (recording.sensors, self._sensors))
            raise FlexcalError(
                "E-FRF-027",
                f"{recording.name}: the sensors on the arm are {own}, but in recordings before it {others}; record the same in all.",
            )
        kept = self._keep(self.plan, recording)
        if not all(np.isfinite(part).all() for part in kept):
            raise FlexcalError(
                "E-FRF-028", f"{recording.name} holds a NaN or an infinite number; record it again."
            )
        self._kept[key] = kept

    def difference(self, part: int) -> np.ndarray:
        """(plus - minus)/2 of a kept spectrum, or plus alone: (R, E, bins, columns)."""
        spectra = self._stack(part, 1)
        if self.plan.signs:
            spectra -= self._stack(part, -1)
            spectra *= 0.5
        return spectra

    def half_sum(self, part: int) -> np.ndarray:
        """(plus + minus)/2 of a kept spectrum, of a plan with both signs: (R, E, bins, columns)."""
        spectra = self._stack(part, 1)
        spectra += self._stack(part, -1)
        spectra *= 0.5
        return spectra

    def _stack(self, part: int, sign: int) -> np.ndarray:
        realisations, experiments = self.plan.realisations, len(self.plan.joints)
        kept = [self._kept[r, e, sign][part] for r in range(realisations) for e in range(experiments)]
        return np.stack(kept).reshape(realisations, experiments, *kept[0].shape)


def by_pose(
    plan: MultisinePlan, recordings: Iterable[Recording], keep: Keep, poses: Sequence[int] | None = None
) -> Iterator[PoseRecords]:
    """Records of `poses` (None: all of the plan) in one pass over recordings in any order; each is yielded once complete.

    Recordings of other poses are passed over. Raises `FlexcalError` for a recording without a label or that does not fit, and where one
    is missing.
    """
    wanted = range(len(plan.poses)) if poses is None else poses
    collected = {pose: PoseRecords(plan, pose, keep) for pose in wanted}
    for recording in recordings:
        if recording.label is None:
            raise FlexcalError(
                "E-FRF-029",
                f"{recording.name} cannot be assigned; give it its pose, realisation, experiment and sign.",
            )
        if recording.label.pose >= len(plan.poses):
            raise FlexcalError("E-FRF-030", f"{recording.name} is not in the plan; remove it.")
        records = collected.get(recording.label.pose)
        if records is not None:
            records.add(recording)
            if records.complete:
                yield records
    for records in collected.values():
        records.check_complete()
