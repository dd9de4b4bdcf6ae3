"""Propagation of the parameter covariance to points at many poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.measurement.prediction import PredictedMeasurements
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import (
    carrier_kinematics,
    depends_on_temperature,
    link_vectors,
    point_kinematics,
    point_placement,
    relative_kinematics,
)
from flexcal.model.parts import LOOP, left_jacobian, vector_rotation
from flexcal.model.robot import (
    EXPANSION,
    GEOMETRY,
    HYSTERESIS,
    LATERAL,
    LINK_EXPANSION,
    MASS_AND_COM,
    ORIGIN,
    RATIO,
    SPRINGS,
    STATION,
    STATION_DRIFT,
    ZERO_DRIFT,
    RobotModel,
)
from flexcal.model.statics import (
    carried_mass,
    elastic_axes,
    gravity_torque,
    lateral_slopes,
    spring_loads,
    tangent_ratio,
    transmission_columns,
    twist_by_hardening,
    twist_from_torque,
)

_THERMAL = (EXPANSION.rpartition(".")[2], LINK_EXPANSION, ZERO_DRIFT, *STATION_DRIFT)
_GEOMETRIC = (
    *GEOMETRY,
    *ORIGIN,
    *LOOP,
    *STATION,
    "backlash",
    HYSTERESIS,
    "gravity_compliance",
    *LATERAL,
    *_THERMAL,
)


def moving_parameters(model: RobotModel, *, elastic: bool = True) -> list[str]:
    """Names in the robot's posterior that affect a point at rest; without `elastic` those that affect the rigid arm."""
    names = model.posterior.parameters.names
    return [n for n in names if _is_geometric(n) or (elastic and _is_elastic(n))]


def covariance_root(model: RobotModel, names: list[str]) -> np.ndarray:
    """Square root R (p, p), R Rᵀ being the covariance of the named parameters in natural units."""
    values, vectors = np.linalg.eigh(model.posterior.marginal(names))
    parameters = model.posterior.parameters.subset(names)
    slopes = parameters.natural_slope(parameters.coordinates())
    return slopes[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def lag_rms(model: RobotModel) -> np.ndarray:
    """Root mean square (joints,), rad, by which each joint is off the middle of its hysteresis where nobody knows from which side it comes.

    √(h² + σ²) of what its calibration, or its prior, has of half the width h; zero where it is in the scatter of the poses, because no
    calibration pose says from which side it was approached.
    """
    names = [f"{joint.name}.{HYSTERESIS}" for joint in model.joints]
    known = [i for i, name in enumerate(names) if model.posterior.determines(name)]
    squares = np.zeros(len(names))
    for i in known:
        squares[i] = model.value(names[i]) ** 2 + model.posterior.marginal([names[i]])[0, 0]
    return np.sqrt(squares)


def unknown_sides(at: PredictedMeasurements) -> np.ndarray:
    """Columns (R, 3, k) of the readings by the hysteresis, of the size `lag_rms`, of joints of which the side of approach is not known.

    Common to all poses: which of them came from the same side is not known either, and all may have.
    """
    model, poses, lag = at.model, at.poses, lag_rms(at.model)
    joints = [k for k, i in enumerate(model.motors) if lag[i] > 0]
    owners = [model.motors[k] for k in joints]
    unknown = (
        np.ones((len(poses), len(joints)), bool) if poses.approach is None else poses.approach[:, joints] == 0
    )
    turns = at.jacobian([f"{model.joints[i].name}.offset" for i in owners])
    return turns * (at.by_row(unknown) * lag[owners])[:, None]


@dataclass(frozen=True, eq=False)
class Propagation:
    """Square root of the parameters' covariance, with rows sorted by their effect on the point `target` under `payload` kg.

    `rows` (G + 6 + d + 4 N + T + 6 + 1 + N, p): by geometric errors of columns and tool, by the stiffness of the d elastic coordinates, by
    mass and first moment of each link, by the T `twisting` parameters (joint and kind, those that tilt its axis included), by the place
    of the `station`, by the expansion of the arm and of each link; natural units. The arm is warmer by `rise`, K, than where these hold.
    """

    model: RobotModel
    target: str
    payload: float
    station: str
    twisting: tuple[tuple[int, str], ...]
    rows: np.ndarray
    rise: float = 0.0

    def roots(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 3) m at `q` (N, n), and roots A (N, 3, k) m: A Aᵀ is the covariance of the point's error.

        Columns are those of the parameters, then those of the scatter, where there is any: repeatability at every joint,
        hysteresis of the joints, repeatability and model error of the coordinates. Both in the base frame, as an instrument at the station
        finds them, without its own noise.
        Derivatives are those of the undeflected arm: they differ by its deflection angles, some 1e-3 of them.
        """
        model, axes = self.model, np.array(elastic_axes(self.model), dtype=int).reshape(-1, 2)
        loads, regressor, coupling = spring_loads(model, q, self.payload)
        at = point_kinematics(model, q, point=self.target)
        still = np.zeros((len(q), model.n, 3))
        carrier = carrier_kinematics(model, q, still, np.full(len(q), self.station), jacobians=True)
        at = at if carrier is None else relative_kinematics(at, carrier)
        stiffness = model.springs.stiffness[axes[:, 0], axes[:, 1]]
        by_load = at.motion_jacobian[:, :3][:, :, axes[:, 0], axes[:, 1]] / -stiffness
        if model.springs.hardening.any():
            hardening = np.where(axes[:, 1] == 2, model.springs.hardening[axes[:, 0]], 0.0)
            by_load /= tangent_ratio(twist_from_torque(loads, stiffness, hardening), hardening)[:, None]
        by_geometry = at.geometry_jacobian[:, :3]
        by_geometry[:, :, : len(model.geometry_columns)] += np.matmul(by_load, coupling)
        twists = by_geometry[:, :, [6 * joint for joint, _ in self.twisting]] * self._twist(q, loads)[:, None]
        self._tilt(q, at.motion_jacobian[:, :3, :, :2], twists)
        columns = (
            by_geometry,
            by_load * (-loads / stiffness)[:, None],
            np.matmul(by_load, regressor),
            twists,
            self._by_station(at.position),
            self._by_expansion(q, at.position),
        )
        stacked = np.concatenate(columns, axis=2)
        roots = stacked.reshape(-1, stacked.shape[2]) @ self.rows
        return at.position, np.concatenate(
            [roots.reshape(len(q), 3, -1), *self._scatter(by_geometry)], axis=2
        )

    def _scatter(self, by_geometry: np.ndarray) -> list[np.ndarray]:
        """Columns (N, 3, k) m of the errors besides the parameters: repeatability and model error."""
        model, columns = self.model, []
        angular = model.scatter.turns(model.value("scatter.angular"))
        if angular.any():
            revolute = [i for i in model.motors if model.joints[i].kind == "revolute"]
            columns.append(angular[revolute] * by_geometry[:, :, [6 * i for i in revolute]])
        lag = lag_rms(model)
        if lag.any():
            columns.append(by_geometry[:, :, [6 * i for i in np.flatnonzero(lag)]] * lag[lag > 0])
        size = np.hypot(model.value("scatter.robot"), model.value("scatter.model"))
        if size > 0:
            columns.append(np.broadcast_to(size * np.eye(3), (len(by_geometry), 3, 3)))
        return columns

    def _twist(self, q: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Rotations (N, T) of joints by the twisting parameters, for springs loaded by `loads` (N, d)."""
        columns = np.empty((len(q), len(self.twisting)))
        torque, waves = self._torque(q, loads), list[int]()
        for k, (joint, kind) in enumerate(self.twisting):
            if kind == "backlash":
                columns[:, k] = -np.sign(torque[:, joint])
            elif kind == "gravity_compliance":
                columns[:, k] = -torque[:, joint]
            elif kind == "hardening":
                hardening = self.model.springs.hardening[joint]
                twist = twist_from_torque(
                    -torque[:, joint], self.model.springs.stiffness[joint, 2], hardening
                )
                columns[:, k] = twist_by_hardening(twist, hardening)
            elif kind == ZERO_DRIFT:
                columns[:, k] = self.rise
            elif kind in (*LATERAL, HYSTERESIS):
                columns[:, k] = 0.0
            else:
                waves.append(k)
        columns[:, waves] = transmission_columns(self.model, q, [self.twisting[k] for k in waves])
        return columns

    def _tilt(self, q: np.ndarray, by_tilt: np.ndarray, twists: np.ndarray) -> None:
        """Write the columns of lateral compliances into `twists` (N, 3, T), `by_tilt` (N, 3, n, 2) being those of the tilts."""
        tilting = [
            (k, joint, LATERAL.index(kind))
            for k, (joint, kind) in enumerate(self.twisting)
            if kind in LATERAL
        ]
        if tilting:
            slopes = lateral_slopes(self.model, q, self.payload)
            for k, joint, axis in tilting:
                twists[:, :, k] = np.matmul(by_tilt[:, :, joint], slopes[:, joint, axis, :, None])[:, :, 0]

    def _torque(self, q: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Gravity torque (N, n) on joints with gravity compliance; torques on drives with springs are in `loads`."""
        loaded = {
            joint for joint, kind in self.twisting if kind in ("backlash", "gravity_compliance", "hardening")
        }
        springs = {
            joint: k for k, (joint, component) in enumerate(elastic_axes(self.model)) if component == 2
        }
        if not loaded <= springs.keys():
            return gravity_torque(self.model, q, self.payload)
        torque = np.zeros((len(q), len(self.model.joints)))
        for joint in loaded:
            torque[:, joint] = loads[:, springs[joint]]
        return torque

    def _by_expansion(self, q: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Motion (N, 3, 1 + joints) of the point by the expansion of the arm and of each link."""
        columns = np.zeros((len(q), 3, 1 + len(self.model.joints)))
        if self.rise != 0:
            end = point_placement(self.model, self.target)[:2]
            columns[:, :, 0] = self.rise * position
            columns[:, :, 1:] = self.rise * link_vectors(self.model, q, end).swapaxes(1, 2)
        return columns

    def _by_station(self, position: np.ndarray) -> np.ndarray:
        """∂(point seen from the station, turned into the base frame)/∂(x, y, z, rx, ry, rz of the station), (N, 3, 6)."""
        place = self.model.stations.pose[self.model.station_index(self.station)]
        turn = vector_rotation(place[3:])
        axes = turn.T @ left_jacobian(place[3:])
        result = np.empty((len(position), 3, 6))
        result[:, :, :3] = turn.T
        result[:, :, 3:] = np.cross(axes.T[None], position[:, None]).swapaxes(1, 2)
        return result


def propagation(
    model: RobotModel,
    *,
    target: str | None = None,
    station: str | None = None,
    payload: float | None = None,
    temperature: float | None = None,
) -> Propagation:
    """Propagation of the posterior of `model` to a target (default: the first), seen from a station (default: the first), under a payload.

    `payload` in kg as `carried_mass` takes it, None for the declared one; `temperature` in °C, None
    for that at which the parameters hold. Raises `FlexcalError` for unknown names, a payload without a
    declaration, and a robot of which nothing was estimated that moves a point.
    """
    name = model.point(target).name
    names = [n for n in moving_parameters(model) if model.posterior.determines(n)]
    if not names:
        raise FlexcalError(
            "E-CAL-014", f"no estimated parameter of {model.name} that moves a point; calibrate it first."
        )
    mass = float(carried_mass(model, None if payload is None else np.array([payload]), 1)[0])
    place = model.stations.names[0] if station is None else station
    root = covariance_root(model, names)
    axes, columns = elastic_axes(model), model.geometry_columns
    errors, bodies = len(columns), 4 * len(model.joints)
    links = [joint.link for joint in model.joints]
    twisting = [_twisting(model, item) for item in names]
    twists = [item for item in twisting if item is not None]
    first_twist = errors + 6 + len(axes) + bodies
    rise = 0.0 if temperature is None else temperature - float(model.thermal.reference[0])
    rise = rise if depends_on_temperature(model) else 0.0
    first_growth = first_twist + len(twists) + 6
    rows = np.zeros((first_growth + 1 + len(model.joints), len(names)))
    for item, row in zip(names, root, strict=True):
        owner, _, key = item.rpartition(".")
        body = errors + 6 + len(axes)
        if item == EXPANSION:
            rows[first_growth] += row
        elif key == LINK_EXPANSION:
            rows[first_growth + 1 + links.index(owner)] += row
        elif owner == f"station.{place}" and key in STATION_DRIFT:
            rows[first_twist + len(twists) + STATION_DRIFT.index(key)] += rise * row
        elif owner == f"station.{place}":
            rows[first_twist + len(twists) + STATION.index(key)] += row
        elif owner == f"point.{name}":
            rows[errors + 3 + "xyz".index(key)] += row
        elif owner == "tool":
            if not key.startswith("length") or name == model.tool_point:
                rows[errors + GEOMETRY.index(key)] += row
        elif item in columns:
            rows[columns[item]] += row
        elif key in ORIGIN:
            joint, axis = model.joint_index(owner), ORIGIN.index(key)
            parent = model.joints[joint].parent
            if joint in model.path_to(model.point(name).joint) and parent >= 0:
                rows[6 * parent + 3 + axis] += row
            elif joint in model.path_to(model.point(name).joint):
                turn = vector_rotation(model.stations.pose[model.station_index(place), 3:])
                rows[first_twist + len(twists) : first_twist + len(twists) + 3] += np.outer(
                    turn[:, axis], row
                )
        elif (twist := _twisting(model, item)) is not None:
            rows[first_twist + twists.index(twist)] += row
        elif key == "stiffness":
            joint, _, spring = owner.rpartition(".")
            rows[errors + 6 + axes.index((model.joint_index(joint), SPRINGS.index(spring)))] += row
        elif owner == "payload":
            attached = model.payload
            assert attached is not None
            own = body + 4 * attached.joint
            share = mass / attached.mass if attached.mass > 0 else 1.0
            moments = share * np.array([1.0, *attached.com_in_link]) if key == "mass" else np.zeros(4)
            if key != "mass":
                moments[1:] = mass * attached.rotation[:, "xyz".index(key[-1])]
            rows[own : own + 4] += np.outer(moments, row)
        elif owner in links:
            i = links.index(owner)
            moments = np.array([1.0, *model.links.com[i]]) if key == "mass" else np.zeros(4)
            if key != "mass":
                moments[1 + "xyz".index(key[-1])] = model.links.mass[i]
            rows[body + 4 * i : body + 4 * i + 4] += np.outer(moments, row)
    return Propagation(model, name, mass, place, tuple(twists), rows, rise)


def _twisting(model: RobotModel, name: str) -> tuple[int, str] | None:
    owner, _, key = name.rpartition(".")
    if key in ("backlash", HYSTERESIS, "gravity_compliance", ZERO_DRIFT, *LATERAL) or key.startswith(
        ("transmission_", RATIO)
    ):
        return model.joint_index(owner), key
    if key == "hardening":
        return model.joint_index(owner.removesuffix(".drive")), key
    return None


def _is_elastic(name: str) -> bool:
    return name.rpartition(".")[2] in ("stiffness", "hardening", *MASS_AND_COM)


def _is_geometric(name: str) -> bool:
    owner, _, key = name.rpartition(".")
    if owner.startswith("point.") and key in STATION[3:]:
        return False
    return key in _GEOMETRIC or key.startswith(("transmission_", RATIO))
