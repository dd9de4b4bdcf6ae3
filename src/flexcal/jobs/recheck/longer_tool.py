"""Points on a longer tool that show shifts of joints which those of the present tool do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from flexcal.calibration.error_model import joint_scatter
from flexcal.calibration.measurement import predict_measurements
from flexcal.calibration.recheck import (
    DetectionLimit,
    GlobalTest,
    detection_limits,
    planned_errors,
    possible_changes,
)
from flexcal.data.poses import PoseSet, concatenate
from flexcal.jobs.recheck.document import SHIFT, UNSEEN, power_block
from flexcal.jobs.recheck.pose_choice import PoseInformation, WhitenedColumns, best_poses
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

ROUNDS = 3
"""Number of readings of every pose at the reference visit, over those at the visits after it, for which the power is predicted."""
_ASKED = 0.9 * SHIFT
"""Shift, rad, that is to be found of every joint: with a reserve, as calibrations of some sixty poses know the scatter to about a tenth."""
_EXAMPLE = 0.3
_LENGTHS = (0.2, 0.3, 0.4, 0.5)
"""Distances, m, of points from the origin of their frame."""
_POINTS = 3
_READINGS = 6
_DIRECTIONS = np.array([u for u in product((-1, 0, 1), repeat=3) if any(u)], dtype=float)


@dataclass(frozen=True, eq=False)
class LongerTool:
    """Points at `places` (P, 3), m in the axes of `frame`, each read `readings` times at every pose of a visit, and what that finds at the
    joint positions `q` (K, n), rad or m.
    """

    frame: str
    places: np.ndarray
    q: np.ndarray
    readings: int
    limits: tuple[DetectionLimit, ...]

    @property
    def worst(self) -> float:
        """Largest of the least shifts of joints that are found, rad or m."""
        return max(limit.found for limit in self.limits if limit.found < UNSEEN)

    @property
    def words(self) -> str:
        """The points and readings."""
        length = np.linalg.norm(self.places[0]) / MILLIMETRE
        where = " and ".join(f"[{', '.join(f'{v:.2f}' for v in place + 0.0)}]" for place in self.places)
        points = "a point" if len(self.places) == 1 else f"{len(self.places)} points"
        often = (
            ""
            if self.readings == 1
            else f", {'each ' if len(self.places) > 1 else ''}read {self.readings} times at every pose"
        )
        return f"{points} {length:.0f} mm from the origin of {self.frame}, as at {where} m{often}"

    def document(self) -> dict[str, Any]:
        """Block of the JSON document."""
        return {
            "frame": self.frame,
            "places": self.places,
            "q": self.q,
            "readings": self.readings,
            "power": power_block(self.limits),
        }


@dataclass(frozen=True, eq=False)
class LongerTools:
    """An `example` of a point 300 mm from the flange, and the tool with the fewest readings that finds 0.05 mrad of every joint, else the
    best of those that were tried (`enough`).
    """

    example: LongerTool
    best: LongerTool

    @property
    def enough(self) -> bool:
        """Whether the best one finds it."""
        return self.best.worst <= _ASKED

    @property
    def lines(self) -> list[str]:
        """What they find, as text."""
        told = f"{SHIFT * 1e3:g} mrad of every joint"
        against = f"against a reference visit with {ROUNDS} times as many readings"
        best = self.best
        finds = f"finds {told}" if self.enough else f"comes closest to {told} of the tools that were tried"
        return [
            f"{self.example.words}, would find ({against}): {found_in_words(self.example.limits)}",
            f"what {finds}: {best.words}: {found_in_words(best.limits)}; declare such points under points:, calibrate with them, and plan "
            "again; whether the arm can carry them, and the instrument sees them, is not checked",
        ]

    def document(self) -> dict[str, Any]:
        """Block of the JSON document."""
        return {"example": self.example.document(), "best": self.best.document(), "enough": self.enough}


def longer_tools(
    model: RobotModel,
    candidates: PoseSet,
    limits: Sequence[DetectionLimit],
    count: int,
    *,
    refit: bool,
) -> LongerTools | None:
    """Longer tools for visits of `count` poses of the `candidates`, where the present one, with these `limits`, does not find 0.05 mrad of
    every joint; None where it does.

    The derivatives of a point are affine in its place on the tool, so four places give those of all. Directions of the points are chosen
    one after the other, then the poses for them, each so that the worst joint is best.
    """
    seen = [limit for limit in limits if limit.found < UNSEEN]
    if not seen or max(limit.found for limit in limits) <= SHIFT:
        return None
    model = _scattering_joints(model, candidates)
    factor = float(np.median([limit.found / limit.std for limit in seen]))
    family = _Family.of(model, candidates, count, refit)
    example = family.tool(_EXAMPLE, 1)
    plans = sorted(
        product(range(1, _POINTS + 1), range(1, _READINGS + 1), _LENGTHS),
        key=lambda plan: (plan[0] * plan[1], plan[2]),
    )
    tools = {
        (points, length): family.tool(length, points)
        for points in range(1, _POINTS + 1)
        for length in _LENGTHS
    }
    best = None
    for points, readings, length in plans:
        tool = tools[points, length]
        if factor * tool.deviations.max() / np.sqrt(readings) > _ASKED:
            continue
        best = family.tested(tool, readings)
        if best.worst <= _ASKED:
            break
    if best is None:
        last = min(tools.values(), key=lambda tool: float(tool.deviations.max()))
        best = family.tested(last, _READINGS)
    return LongerTools(family.tested(example, 1), best)


@dataclass(frozen=True, eq=False)
class _Tool:
    places: np.ndarray
    chosen: np.ndarray
    deviations: np.ndarray


@dataclass(frozen=True, eq=False)
class _Family:
    """Whitened derivatives of a point at the origin of its frame, and what they change by a metre along each axis (3), at candidates."""

    model: RobotModel
    candidates: PoseSet
    count: int
    refit: bool
    origin: WhitenedColumns
    along: np.ndarray

    @classmethod
    def of(cls, model: RobotModel, candidates: PoseSet, count: int, refit: bool) -> _Family:
        name = str(candidates.target[0])
        at = [
            WhitenedColumns.of(_with_place(model, name, place), candidates)
            for place in (np.zeros(3), *np.eye(3))
        ]
        along = np.array([item.columns - at[0].columns for item in at[1:]])
        return cls(model, candidates, count, refit, at[0], along)

    def information(self, places: np.ndarray) -> PoseInformation:
        joints = self.origin.joints
        each = [
            WhitenedColumns(self.origin.columns + np.tensordot(place, self.along, 1), joints).information
            for place in places
        ]
        return PoseInformation(np.sum(each, axis=0), joints)

    def tool(self, length: float, points: int) -> _Tool:
        """Points in the best directions at the best poses."""
        directions = length * _DIRECTIONS / np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
        each = [self.information(place[None]).matrices for place in directions]
        every = np.arange(len(self.candidates))
        # a joint that no point shows, as a first one beside an instrument that is set up anew, is not this tool's matter
        seen = np.min([self._deviations(item, every) for item in each], axis=0) < UNSEEN
        picked = self._picked(each, every, seen, points)
        chosen = every
        for _ in range(2):
            whole = PoseInformation(np.sum([each[k] for k in picked], axis=0), self.origin.joints)
            chosen = best_poses(whole, self.count, refit=self.refit)
            picked = self._picked(each, chosen, seen, points)
        matrices = np.sum([each[k] for k in picked], axis=0)
        return _Tool(directions[picked], chosen, self._deviations(matrices, chosen)[seen])

    def _picked(
        self, each: Sequence[np.ndarray], chosen: np.ndarray, seen: np.ndarray, points: int
    ) -> list[int]:
        """Directions of several points, one after the other, that make the worst of the `seen` joints best at the `chosen` poses."""
        picked: list[int] = []
        whole = np.zeros_like(each[0])
        for _ in range(points):
            left = [k for k in range(len(each)) if k not in picked]
            worst = [self._deviations(whole + each[k], chosen)[seen].max() for k in left]
            picked.append(left[int(np.argmin(worst))])
            whole = whole + each[picked[-1]]
        return picked

    def tested(self, tool: _Tool, readings: int) -> LongerTool:
        """What a tool finds, by the test of a visit with it."""
        point = self.model.points[str(self.candidates.target[0])]
        names = [f"{point.name} {k}" for k in range(1, len(tool.places) + 1)]
        model = _with_points(self.model, point.name, dict(zip(names, tool.places, strict=True)))
        rows = self.candidates.subset(tool.chosen)
        poses = all_points([replace(rows, target=np.full(len(rows), name)) for name in names])
        errors = planned_errors(
            model, poses, compared="reference", placed=self.refit, rounds=ROUNDS, readings=readings
        )
        test = GlobalTest.of(errors, possible_changes(model, errors.at))
        return LongerTool(point.frame, tool.places, rows.q, readings, detection_limits(test, SHIFT))

    def _deviations(self, matrices: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Standard deviations (J,) of joints, of a difference to the reference."""
        found = PoseInformation(matrices, self.origin.joints).deviations(chosen, refit=self.refit)
        return found * np.sqrt(1 + 1 / ROUNDS)


def all_points(rows: Sequence[PoseSet]) -> PoseSet:
    """Several points at the same poses, each read where the robot stands once."""
    return replace(concatenate(rows), pose=np.concatenate([own.pose for own in rows]))


def found_in_words(limits: Sequence[DetectionLimit]) -> str:
    """Shifts that are found, joint by joint."""
    told = []
    for limit in limits:
        unit = "mrad" if limit.unit == "rad" else "mm"
        told.append(
            f"{limit.subject} not seen"
            if limit.found >= UNSEEN
            else f"{limit.subject} {limit.found * 1e3:.3f} {unit}"
        )
    return ", ".join(told)


def _scattering_joints(model: RobotModel, candidates: PoseSet) -> RobotModel:
    """Robot whose scatter of points, as calibrated, is one of the revolute joints, as large at the candidates."""
    names = [f"{joint.name}.offset" for joint in model.motor_joints if joint.kind != "prismatic"]
    at = predict_measurements(model, candidates, jacobians=True)
    lever = float(np.sqrt(np.mean(np.sum(at.jacobian(names) ** 2, axis=2)))) if names else 0.0
    if not lever:
        return model
    own = [name for name in joint_scatter(model) if model.value(name) > 0]
    more = model.value("scatter.robot") / lever
    angular = {name: float(np.hypot(model.value(name), more)) for name in ("scatter.angular", *own)}
    return model.with_values({"scatter.robot": 0.0, **angular})


def _with_place(model: RobotModel, name: str, place: np.ndarray) -> RobotModel:
    """Robot one of whose points is elsewhere on the tool."""
    return replace(model, points={**model.points, name: replace(model.points[name], xyz=place)})


def _with_points(model: RobotModel, like: str, places: dict[str, np.ndarray]) -> RobotModel:
    """Robot with further points in the frame of one."""
    points = {name: replace(model.points[like], name=name, xyz=place) for name, place in places.items()}
    none = np.zeros((len(points), 3))
    geometry = replace(
        model.geometry,
        point_error=np.vstack([model.geometry.point_error, none]),
        point_turn=np.vstack([model.geometry.point_turn, none]),
        point_zero=np.vstack([model.geometry.point_zero, none]),
    )
    return replace(model, points={**model.points, **points}, geometry=geometry)
