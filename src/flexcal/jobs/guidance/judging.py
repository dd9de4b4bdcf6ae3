"""Judges a row beside those of a session."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.measurement import predict_measurements
from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet
from flexcal.jobs.guidance.analysis import Analysis, with_implausible_temperatures_replaced
from flexcal.jobs.guidance.consistency import FEWEST, length_ratio
from flexcal.jobs.guidance.disturbances import Disturbance
from flexcal.jobs.guidance.judgement import Finding, Judgement, moved_far_text, radius
from flexcal.jobs.inputs import Misreading, misread_point, other_pose, planned_pose
from flexcal.model.robot import RobotModel
from flexcal.report.results import chance_in_words
from flexcal.units import MILLIMETRE, temperature_fault

_CERTAIN = 5.5
"""Standard deviations by which a row must be off to be noticed, about the one at p = 1e-3 among a hundred rows."""
_SHARP = 1 * MILLIMETRE
"""Error, m, that must be noticed before a row is called good, unless the robot scatters by as much."""
_BLURRED = 2.0
"""Factor by which it may exceed what the scatter of robot and instrument alone hides."""
_NEAR = 2
"""Rows by which the beginning of a motion may change as further rows come."""
_REPEATED = 2e-4
"""Difference of joint positions, rad or m, up to which a pose is the same one again."""
_LEAST = 1e-6
"""Least variance of a residual relative to that of the noise: the rest is rounding."""
_MISFIT_ROWS = 8


@dataclass(frozen=True, eq=False)
class RowJudge:
    """Judges the last row of the analysis `after`, of which `before` has all others."""

    model: RobotModel
    before: Analysis | None
    after: Analysis
    plan: PosePlan | None

    def judgement(self) -> Judgement:
        """Judgement of the row."""
        estimate = self.after.estimate
        if estimate is None:
            return self._unjudged()
        since = self.after.consistent.moved
        if since is not None and (self.before is None or self.before.consistent.moved != since):
            pose = int(self.after.rows.pose[since])
            return Judgement("moved", moved_far_text(pose), pose=pose)
        if not self.after.used[self._station].any():
            return self._unjudged()
        if not self.after.used[-1]:
            return self._gross()
        known = (
            []
            if self.before is None
            else [(d.kind, self.before.pose_of(d)) for d in self.before.disturbances]
        )
        for item in self.after.disturbances:
            if item.kind == "outlier" and self._is_last(item):
                return self._outlier(item)
            if item.kind != "outlier" and not self._is_known(item, known):
                finding = Finding.of(self.after, item)
                return replace(
                    self._fitting(), code=item.kind, sentence=finding.sentence, pose=finding.pose, p=item.p
                )
        return self._odd_temperature() or self._repeat() or self._fitting()

    def _odd_temperature(self) -> Judgement | None:
        """Judgement of a row whose temperature cannot be the arm's; None for others."""
        rows = self.after.rows
        if rows.temperature is None:
            return None
        value = float(rows.temperature[-1])
        likely = with_implausible_temperatures_replaced(rows).temperature
        assert likely is not None
        if likely[-1] == value:
            return None
        pose = int(rows.pose[-1])
        fault = temperature_fault(value)
        told = (
            f"the temperature of pose {pose} {fault}"
            if fault
            else f"the temperature of pose {pose}, {value:.1f} °C, is far from those of the others, {likely[-1]:.1f} °C in the median: "
            "correct it, or the calibration leaves the row out."
        )
        return replace(self._fitting(), code="outlier", sentence=told)

    @property
    def _row(self) -> PoseSet:
        return self.after.rows.subset([len(self.after.rows) - 1])

    @property
    def _station(self) -> np.ndarray:
        """Mask (N,) of the rows of the same station."""
        return self.after.rows.station == self.after.rows.station[-1]

    def _is_last(self, item: Disturbance) -> bool:
        return int(self.after.index[item.row]) == len(self.after.rows) - 1

    def _is_known(self, item: Disturbance, known: list[tuple[str, int]]) -> bool:
        if item.kind == "drift":
            return any(kind == "drift" for kind, _ in known)
        at = self.after.index[item.row]
        near = self.after.rows.pose[max(at - _NEAR, 0) : at + _NEAR + 1]
        return any(kind == "moved" and pose in near for kind, pose in known)

    def _left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Difference (3,), m, of the row from what all others predict for it, and its covariance (3, 3), m²."""
        estimate = self.after.estimate
        assert estimate is not None
        noise = estimate.std[-1] ** 2
        values, vectors = np.linalg.eigh(estimate.spread[-1])
        inverse = vectors / np.maximum(values, _LEAST * noise) @ vectors.T
        return noise * inverse @ estimate.residual[-1], noise**2 * inverse

    def _fitting(self) -> Judgement:
        """Judgement of a row with which nothing is wrong."""
        difference, covariance = self._left_out()
        error, expected = float(np.linalg.norm(difference)), radius(covariance)
        noticeable = _CERTAIN * float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
        pose = int(self._row.pose[0])
        estimate = self.after.estimate
        assert estimate is not None
        if noticeable > max(_SHARP, _BLURRED * _CERTAIN * float(estimate.std[-1])):
            needed = max(-(-estimate.unknowns.geometric // 3) + 2, len(self.after.index) + 2)
            return Judgement(
                "too_early",
                f"pose {pose} fits so far, but an error below {noticeable / MILLIMETRE:.1f} mm would not show yet: "
                f"{estimate.unknowns.geometric} numbers of the robot are still open, and about {needed} rows tell them.",
                error=error,
                expected=expected,
                noticeable=noticeable,
            )
        return Judgement(
            "good",
            f"pose {pose} is {error / MILLIMETRE:.2f} mm from where it is expected (95 % within {expected / MILLIMETRE:.2f} mm).",
            error=error,
            expected=expected,
            noticeable=noticeable,
        )

    def _repeat(self) -> Judgement | None:
        rows, row = self.after.rows.subset(slice(0, len(self.after.rows) - 1)), self._row
        same = (np.abs(rows.q - row.q).max(axis=1) < _REPEATED) & (rows.target == row.target[0])
        same &= (rows.station == row.station[0]) & self.after.used[:-1]
        if rows.payload is not None and row.payload is not None:
            same &= rows.payload == row.payload[0]
        if not same.any():
            return None
        k = int(np.flatnonzero(same)[-1])
        pair = self.after.rows.subset([k, len(rows)])
        predicted = predict_measurements(self.model, pair).located
        apart = float(np.linalg.norm(np.diff(pair.position, axis=0) - np.diff(predicted, axis=0)))
        fitting, pose = self._fitting(), int(rows.pose[k])
        return replace(
            fitting,
            code="repeat",
            pose=pose,
            sentence=f"pose {int(row.pose[0])} repeats pose {pose}: they differ by {apart / MILLIMETRE:.3f} mm (repeatability), "
            "and the robot's geometry is told by other poses only.",
        )

    def _outlier(self, item: Disturbance) -> Judgement:
        shift, _ = self.after.shift_of(item)
        error = float(np.linalg.norm(shift[-1]))
        estimate = self.after.estimate
        assert estimate is not None
        predicted, spread = estimate.predicted(self._row)
        expected = radius(spread[0] + estimate.std[-1] ** 2 * np.eye(3))
        cause = self._misread(predicted[0], expected)
        pose = int(self._row.pose[0])
        if cause is not None:
            return self._caused(cause, error, expected, item.p)
        return Judgement(
            "outlier",
            f"pose {pose} is {error / MILLIMETRE:.2f} mm off, where 95 % of good rows are within {expected / MILLIMETRE:.2f} mm "
            f"({chance_in_words(item.p)}): either this row alone is wrong, or the tracker or the base has moved; the next row will tell, "
            "best a pose measured before.",
            error=error,
            expected=expected,
            p=item.p,
        )

    def _gross(self) -> Judgement:
        """Judgement of a row that cannot be where the robot was."""
        estimate, row = self.after.estimate, self._row
        assert estimate is not None
        if self._is_misfit:
            return self._misfit()
        if (since := self.after.consistent.moved) is not None:
            pose = int(self.after.rows.pose[since])
            return Judgement("moved", moved_far_text(pose), pose=pose)
        predicted, spread = estimate.predicted(row)
        error = float(np.linalg.norm(row.position[0] - predicted[0]))
        expected = radius(spread[0] + estimate.expected_std(row)[0] ** 2 * np.eye(3))
        cause = self._misread(predicted[0], expected)
        if cause is not None:
            return self._caused(cause, error, expected, None)
        return Judgement(
            "outlier",
            f"pose {int(row.pose[0])} is {error / MILLIMETRE:.0f} mm from where the robot was: its joint values or its point are of "
            "something else; measure it again.",
            error=error,
            expected=expected,
        )

    def _caused(self, cause: Misreading, error: float, expected: float, p: float | None) -> Judgement:
        pose = int(self._row.pose[0])
        fits = "" if cause.left >= error else f"; then it fits to {cause.left / MILLIMETRE:.2f} mm"
        return Judgement(
            cause.kind,  # pyright: ignore[reportArgumentType]
            f"pose {pose} is {error / MILLIMETRE:.4g} mm off: {cause.words}{fits}.",
            pose=cause.pose,
            error=error,
            expected=expected,
            p=p,
        )

    def _misread(self, expected: np.ndarray, within: float) -> Misreading | None:
        """What explains the row's point, which should be at `expected` (3,), m, up to about `within` m."""
        estimate, row, count = self.after.estimate, self._row, len(self.after.rows) - 1
        assert estimate is not None
        tolerance = 2 * within + 0.5 * MILLIMETRE
        point = misread_point(row.position[0], expected, tolerance)
        if point is not None:
            return point
        rows = self.after.rows.subset(slice(0, count))
        same = (rows.station == row.station[0]) & (rows.target == row.target[0])
        rows = rows.subset(same)
        other = other_pose(row.q[0], row.position[0], expected, rows.q, rows.position, rows.pose, tolerance)
        if self.plan is None:
            return other
        places = estimate.predicted(_at(row, self.plan.q))[0]
        planned = planned_pose(row.position[0], expected, places, self.plan.numbers, tolerance)
        if other is None or planned is None or other.pose == planned.pose:
            return other or planned
        return replace(other, words=f"{other.words}, and {planned.words}")

    def _unjudged(self) -> Judgement:
        """Judgement where it is not known yet where the row's station stands."""
        own = self.after.rows.subset(self._station)
        station = str(own.station[0])
        if station in self.after.consistent.mirrored:
            return Judgement(
                "axes",
                f"the points of all {len(own)} rows fit the robot only in a mirror: one of x, y, z has the wrong sign, or two of them are "
                "swapped.",
            )
        ratio = length_ratio(predict_measurements(self.model, own).located, own)
        if ratio is not None:
            for factor, words in (
                (1e3, "mm given as m"),
                (1e-3, "m given as mm"),
                (1 / 0.0254, "inches given as m"),
            ):
                if abs(ratio / factor - 1) < 0.05:
                    return Judgement(
                        "unit", f"the points are {ratio:.4g} times as far apart as the robot's: {words}."
                    )
        if self._is_misfit:
            return self._misfit()
        name = "the instrument" if self._station.all() else f"'{station}'"
        return Judgement(
            "too_early",
            f"pose {int(self._row.pose[0])} cannot be judged yet: {FEWEST} rows that do not lie on a line tell roughly where {name} "
            f"stands, and there {'is' if len(own) == 1 else 'are'} {len(own)}.",
        )

    @property
    def _is_misfit(self) -> bool:
        own = self.after.used[self._station]
        return len(own) >= _MISFIT_ROWS and own.sum() * 2 < len(own)

    def _misfit(self) -> Judgement:
        own = self.after.used[self._station]
        return Judgement(
            "misfit",
            f"the points of {int((~own).sum())} of {len(own)} rows are not where this robot can have been: check the order, "
            "signs and units of the joint values and of x, y, z, and the place of the point on the tool in robot.yaml; 'flexcal import' "
            "finds these from a whole file.",
        )


def _at(row: PoseSet, q: np.ndarray) -> PoseSet:
    """The target of a row at other joint positions `q` (M, n)."""
    many = row.subset(np.zeros(len(q), dtype=int))
    return replace(many, q=q, torque=None)
