"""Instruments that a plan of poses may be for, other than a tracker of points: where they stand, and what they read at a pose."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flexcal.calibration.kinds import turn_to_z
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import DEFAULT_SIGMA, DISTANCE, LINE, PLANE, PoseSet, kind_of_face
from flexcal.design.poses.camera_setup import CameraSetup
from flexcal.design.poses.tilt_setup import TiltSetup
from flexcal.errors import FlexcalError
from flexcal.files.structuring import suggestion
from flexcal.model.kinematics import joint_ranges, point_kinematics
from flexcal.model.parts import rotation_wxyz, vector_rotation
from flexcal.model.robot import (
    STATION,
    FaceConfig,
    RobotModel,
    SocketsConfig,
    WireConfig,
    socket_scale,
)

POSE = "pose"
"""Name of a tracker that measures orientations too."""
_SOCKETS = "sockets"
_TURN_SIGMA = 1e-4
"""Standard deviation, rad, of a measured orientation."""
_STEPS, _REACHED = 25, 1e-9
_DISTANT, _TILTED = 0.02, 0.02
"""Standard deviations, m and rad, of a place that was measured with a tape."""


@dataclass(frozen=True, eq=False)
class Instrument:
    """Instrument by the `name` under `measurements:`, or `POSE`, with its places `at` (k, 3), m, and `normals` (3,) in the base frame.

    `kind` is that of its readings ("" for whole points, "sockets" for points at known places of a fixture), `sockets` (s, 3) the places
    in it, `radius` of a sphere, m, `sigma`, m, of a reading, and `scale_std` of all lengths together, relative.
    """

    name: str
    kind: str
    sigma: float
    at: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))
    normal: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    sockets: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    radius: float = 0.0
    touched: bool = False
    scale_std: float = 0.0

    @classmethod
    def of(cls, name: str, item: SocketsConfig | WireConfig | FaceConfig) -> Instrument:
        """Instrument that robot.yaml declares, with its place, under a name."""
        places = item.at if item.kind == "sockets" else (item.xyz,)
        if item.kind == "sockets":
            return cls(
                name,
                _SOCKETS,
                DEFAULT_SIGMA,
                np.array(places, dtype=float),
                sockets=np.array(list(item.sockets.values()), dtype=float),
                touched=True,
                scale_std=item.std / item.extent if item.extent > 0 else 0.0,
            )
        sigma = DEFAULT_SIGMA if item.std is None else item.std
        if item.kind == "wire":
            return cls(name, DISTANCE, sigma, np.array(places, dtype=float), scale_std=item.scale_std)
        normal = np.array(item.normal) / np.linalg.norm(item.normal)
        return cls(
            name,
            kind_of_face(item.kind),
            sigma,
            np.array(places, dtype=float),
            normal,
            radius=item.radius,
            touched=True,
        )

    @property
    def tells_base(self) -> bool:
        """Whether the readings tell where the base of the robot is."""
        return self.name == POSE

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the places."""
        return (
            tuple(f"{self.name}_{k + 1}" for k in range(len(self.at)))
            if self.kind == _SOCKETS
            else (self.name,)
        )

    def nuisances(self, target: str) -> dict[str, float]:
        """Parameters of the instrument, and of the axes of a measured target, with their standard deviations beforehand."""
        stds: dict[str, float] = dict.fromkeys(("x", "y", "z"), _DISTANT)
        tilts = dict.fromkeys(("rx", "ry", "rz"), _TILTED)
        if self.name == POSE:
            return {f"point.{target}.{key}": std for key, std in tilts.items()}
        if self.kind == DISTANCE:
            stds["zero"] = _DISTANT
        elif self.kind == PLANE:
            stds = {"z": _DISTANT, "rx": _TILTED, "ry": _TILTED}
        elif self.kind == LINE:
            stds = {"x": _DISTANT, "y": _DISTANT, "rx": _TILTED, "ry": _TILTED}
        else:
            stds |= tilts if len(self.sockets) > 1 else {}
        scale = socket_scale(self.name) if self.kind == _SOCKETS else f"station.{self.name}.scale"
        placed = {f"station.{station}.{key}": std for station in self.stations for key, std in stds.items()}
        return placed | ({scale: self.scale_std} if self.scale_std > 0 else {})

    def placed(self, model: RobotModel, _target: str) -> RobotModel:
        """Robot with the instrument's places as stations."""
        if self.name == POSE:
            return model
        model, values = model.with_stations(self.stations), {}
        turn = turn_to_z(self.normal) if self.kind in (PLANE, LINE) else np.zeros(3)
        rotation = vector_rotation(turn)
        for station, place in zip(self.stations, self.at, strict=True):
            numbers = zip(STATION, (*(-rotation @ place), *turn), strict=True)
            values |= {f"station.{station}.{key}": float(value) for key, value in numbers}
        if self.kind == DISTANCE:
            values[f"station.{self.name}.zero"] = self.radius
        return model.with_values(values)

    def poses(self, model: RobotModel, q: np.ndarray, target: str, spot: np.ndarray | None = None) -> PoseSet:
        """Pose set of readings at `q` (N, n), of which only their kind counts; `spot` (N,) numbers socket and place, else the nearest."""
        held, tracked, rows = self.kind == _SOCKETS, self.name == POSE, len(q)
        if held:
            number = self._nearest(model, q, target) if spot is None else spot
            names = np.array(self.stations)[number // len(self.sockets)]
            position = self.sockets[number % len(self.sockets)]
        else:
            names = np.full(rows, model.stations.names[0] if tracked else self.name)
            position = np.zeros((rows, 3))
            if self.scale_std > 0:
                at = point_kinematics(model, q, point=target, jacobians=False).position
                position[:, 0] = np.linalg.norm(at - self.at[0], axis=1)
        return PoseSet(
            q=q,
            position=position,
            sigma=np.full((rows, 3), self.sigma),
            torque=None,
            payload=None,
            target=np.full(rows, target),
            station=names,
            temperature=None,
            pose=np.arange(rows),
            quaternion_wxyz=rotation_wxyz(_axes(model, q, target)) if tracked else None,
            orientation_sigma=np.full(rows, _TURN_SIGMA) if tracked else None,
            socket=np.full(rows, "held") if held else None,
            holder=np.full(rows, self.name) if held else None,
            kind=None if self.kind in ("", _SOCKETS) else np.full(rows, self.kind),
        )

    def _nearest(self, model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
        """Numbers (N,) of the sockets at their places that are nearest to the point at `q` (N, n)."""
        spots = (self.at[:, None] + self.sockets).reshape(-1, 3)
        point = point_kinematics(model, q, point=target, jacobians=False).position
        return np.argmin(np.linalg.norm(point[:, None] - spots, axis=2), axis=1)

    def reached(self, model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
        """Configurations (M, n) near `q` (N, n), without those that fail, at contact, by Newton's method with the shortest steps.

        All of `q` where nothing is touched.
        """
        if not self.touched:
            return q
        placed, (lower, upper) = self.placed(model, target), joint_ranges(model)
        spots = np.arange(len(q)) % max(len(self.at) * len(self.sockets), 1)
        good = np.ones(len(q), dtype=bool)
        for _ in range(_STEPS):
            at = predict_measurements(
                placed, self.poses(model, q, target, spots), elastic=False, jacobians=True
            )
            missing = at.residual
            good = np.linalg.norm(missing, axis=1) < _REACHED
            if good.all():
                break
            columns = at.jacobian([f"{name}.offset" for name in model.motor_names])
            q = q + (np.linalg.pinv(columns, rcond=1e-6) @ missing[:, :, None])[:, :, 0]
        return q[good & (q >= lower).all(axis=1) & (q <= upper).all(axis=1)]

    def rows(self, placed: RobotModel, q: np.ndarray, target: str, names: tuple[str, ...]) -> np.ndarray:
        """Rows (N, r, p) of the readings at `q` (N, n) in the parameters `names`, in standard deviations of a reading."""
        at = predict_measurements(placed, self.poses(placed, q, target), elastic=False, jacobians=True)
        columns, sigma = at.jacobian(names), at.readings.sigma
        white = np.divide(columns, sigma[:, :, None], out=np.zeros_like(columns), where=sigma[:, :, None] > 0)
        return white.reshape(-1, len(q), 3, len(names)).transpose(1, 0, 2, 3).reshape(len(q), -1, len(names))


def declared_instrument(model: RobotModel, name: str) -> Instrument | CameraSetup | TiltSetup:
    """Instrument that robot.yaml declares under a name, or `POSE`.

    Raises `FlexcalError` for an unknown name, and where robot.yaml does not say where the instrument stands.
    """
    if name == POSE:
        return Instrument(name, "", DEFAULT_SIGMA / 4)
    if name not in model.config.measurements:
        known = [*model.config.measurements, POSE]
        hint = suggestion(name, known) or f"; known are {', '.join(known)}."
        raise FlexcalError("E-DESIGN-053", f"there is no '{name}' under `measurements:` of robot.yaml{hint}")
    item = model.config.measurements[name]
    if item.kind == "inclinometer":
        return TiltSetup(name, item)
    places = item.at if item.kind == "sockets" else (item.xyz,)
    if not places or places[0] is None:
        key = "at: [[0.5, 0, 0.1], [0.5, 0.3, 0.1]]" if item.kind == "sockets" else "xyz: [0.5, 0, 0.1]"
        thing = f"the board of {name}" if item.kind == "camera" and item.mounted == "hand" else name
        raise FlexcalError(
            "E-DESIGN-055",
            f"robot.yaml does not say roughly where {thing} stands, m in the base frame; add `{key}` to {name} under `measurements:`.",
        )
    return CameraSetup.of(name, item) if item.kind == "camera" else Instrument.of(name, item)


def _axes(model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
    """Axes (N, 3, 3) of a target, as the first station sees them."""
    place = model.stations.pose[0, 3:]
    turn = vector_rotation(model.geometry.point_turn[list(model.points).index(target)])
    seen = point_kinematics(model, q, point=target, jacobians=False).orientation
    return vector_rotation(place) @ seen @ turn
