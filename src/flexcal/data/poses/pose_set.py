"""Measured poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexcal.data.camera import Lens
from flexcal.errors import FlexcalError
from flexcal.model.robot import FACES

DISTANCE, PLANE, LINE, DIRECTION = "distance", "plane", "line", "direction"
"""Kinds of measurements that are not of three coordinates."""
_COORDINATES = {**FACES, DISTANCE: (True, False, False), DIRECTION: (False, False, False)}
_SAME = {"wire": DISTANCE, "sphere": DISTANCE}
"""What is read alike is of one kind."""
DEFAULT_SIGMA = 1e-4
"""Default 1σ of a measured coordinate (m); only its size relative to priors matters."""


def kind_of_face(declared: str) -> str:
    """Kind of the measurements of a wire, or of contacts with a face, by the `kind` that robot.yaml declares."""
    return _SAME.get(declared, declared)


@dataclass(frozen=True, eq=False)
class PoseSet:
    """N measured points of an n-joint robot, one row per pose and target, in measuring order.

    Parameters
    ----------
    q : ndarray
        Motor positions (N, n) referred to the joint, rad (m where prismatic).
    position : ndarray
        Measured points (N, 3) in the instrument's frame, m; of the other kinds what the instrument reads, see `kind`.
    sigma : ndarray
        Standard deviations (N, 3) of the measured coordinates, m.
    torque : ndarray or None
        Motor torques (N, n) referred to the joint, N m, where measured.
    payload : ndarray or None
        Mass (N,), kg, at the declared payload's centre of mass; None for as declared in robot.yaml.
    target, station : ndarray
        Names (N,) of the points and of the instrument's places.
    temperature : ndarray or None
        Temperature (N,), where measured.
    pose : ndarray
        Numbers (N,) of the poses; rows of one pose share it.
    quaternion_wxyz : ndarray, optional
        Measured orientations (N, 4) of the target's axes in the instrument's frame, unit norm; NaN where only the point is measured.
    orientation_sigma : ndarray, optional
        Standard deviations (N,) of a measured orientation about each axis, rad.
    covariance : ndarray, optional
        Joint covariances (N, 6, 6) of a measured point and its orientation, m and rad in the instrument's axes, in place of `sigma` and
        `orientation_sigma`; NaN where these hold.
    camera : ndarray, optional
        Names (N,) of the cameras that measured; empty where none did.
    by_lens : ndarray, optional
        Change (N, 6, 9) of a measured point and orientation with the intrinsic parameters of its camera, in the order of `LENS`.
    lenses : mapping of Lens
        Intrinsic parameters of the cameras by name, with which the poses were measured.
    kind : ndarray, optional
        Kinds (N,) of measurements that are not of three coordinates, empty for points. "distance": the first coordinate is the distance
        from the instrument's origin, as by a draw-wire or a touched sphere; "plane": the third is the distance from the plane z = 0 of its
        frame, as by a dial gauge or contact with a table; "line": the first and second are those from its z axis. The others are zero.
        "direction": none, see `tilt`.
    tilt : ndarray, optional
        Readings (N, 3) of the axes of an inclinometer, rad or 1 as robot.yaml declares; NaN for axes that it does not have.
    time : ndarray, optional
        Times (N,) of the measurements, s.
    socket : ndarray, optional
        Names (N,) of the sockets that held the target; empty where an instrument measured it. `position` then is the socket's in
        the fixture, and `station` the place of the fixture.
    holder : ndarray, optional
        Names (N,) under `measurements:` of the fixtures with these sockets; empty where an instrument measured.
    force : ndarray, optional
        Known forces (N, 3) on the measured points, N in the base frame, as of a wire that pulls; zero where there are none.
    approach : ndarray, optional
        Sign (N, n) of the last motion of each joint before it stood still: 1 where it came from below, -1 from above, 0 where that is not
        known.
    notes : tuple of str
        What was left out or turned when the measurements were read, and why.
    sigma_given : bool
        False where `sigma` is a default.
    unstated : ndarray, optional
        Rows (N,) of instruments without a stated noise beside others that have one: their `sigma` is a default.

    Raises
    ------
    FlexcalError
        Where shapes do not fit.
    """

    q: np.ndarray
    position: np.ndarray
    sigma: np.ndarray
    torque: np.ndarray | None
    payload: np.ndarray | None
    target: np.ndarray
    station: np.ndarray
    temperature: np.ndarray | None
    pose: np.ndarray
    quaternion_wxyz: np.ndarray | None = None
    orientation_sigma: np.ndarray | None = None
    covariance: np.ndarray | None = None
    camera: np.ndarray | None = None
    by_lens: np.ndarray | None = None
    lenses: Mapping[str, Lens] = field(default_factory=dict)
    kind: np.ndarray | None = None
    tilt: np.ndarray | None = None
    time: np.ndarray | None = None
    socket: np.ndarray | None = None
    holder: np.ndarray | None = None
    force: np.ndarray | None = None
    approach: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    sigma_given: bool = True
    unstated: np.ndarray | None = None

    @classmethod
    def unmeasured(
        cls,
        q: np.ndarray,
        target: str | np.ndarray,
        station: str | np.ndarray,
        sigma: float | np.ndarray = DEFAULT_SIGMA,
    ) -> PoseSet:
        """Poses where nothing was measured: positions are zero, and poses numbered from 1.

        Parameters
        ----------
        q : ndarray
            Motor positions (N, n) referred to the joint, rad (m where prismatic).
        target, station : str or ndarray
            Name of the point and of the instrument's place, or those (N,) of the rows.
        sigma : float or ndarray
            Standard deviation of a coordinate, m, or those (N,) of the rows.

        Returns
        -------
        PoseSet
            N poses without torques, payload and temperature.
        """
        rows = len(q)
        return cls(
            q=q,
            position=np.zeros((rows, 3)),
            sigma=np.repeat(np.broadcast_to(sigma, rows)[:, None], 3, axis=1),
            torque=None,
            payload=None,
            target=np.array(np.broadcast_to(target, rows)),
            station=np.array(np.broadcast_to(station, rows)),
            temperature=None,
            pose=np.arange(1, rows + 1),
        )

    def __post_init__(self) -> None:
        if self.q.ndim != 2:
            raise FlexcalError(
                "E-POSES-021", f"q of a pose set has shape {self.q.shape}; (poses, joints) is needed."
            )
        n_rows, n = self.q.shape
        shapes = {
            "position": (n_rows, 3),
            "sigma": (n_rows, 3),
            "torque": (n_rows, n),
            "payload": (n_rows,),
            "target": (n_rows,),
            "station": (n_rows,),
            "temperature": (n_rows,),
            "pose": (n_rows,),
            "quaternion_wxyz": (n_rows, 4),
            "orientation_sigma": (n_rows,),
            "covariance": (n_rows, 6, 6),
            "camera": (n_rows,),
            "by_lens": (n_rows, 6, 9),
            "kind": (n_rows,),
            "tilt": (n_rows, 3),
            "time": (n_rows,),
            "socket": (n_rows,),
            "holder": (n_rows,),
            "force": (n_rows, 3),
            "approach": (n_rows, n),
            "unstated": (n_rows,),
        }
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                raise FlexcalError(
                    "E-POSES-022", f"{name} of a pose set has shape {values.shape}; {shape} is needed."
                )

        if self.socket is not None and self.holder is None:
            raise FlexcalError(
                "E-POSES-078", "a pose set with sockets needs `holder`, the name of the fixture of each row."
            )

    def __len__(self) -> int:
        return self.q.shape[0]

    @property
    def in_socket(self) -> np.ndarray:
        """Rows (N,) whose target was held by a socket."""
        return np.zeros(len(self), bool) if self.socket is None else self.socket != ""

    @property
    def present(self) -> np.ndarray:
        """Coordinates (N, 3) of `position` that were measured."""
        result = np.ones((len(self), 3), bool)
        if self.kind is not None:
            for name, coordinates in _COORDINATES.items():
                result[self.kind == name] = coordinates
        return result

    def of_kind(self, kind: str) -> np.ndarray:
        """Rows of a kind of measurement.

        Parameters
        ----------
        kind : str
            Entry of the field `kind`.

        Returns
        -------
        ndarray
            Mask (N,).
        """
        return np.zeros(len(self), bool) if self.kind is None else self.kind == kind

    @property
    def far(self) -> np.ndarray:
        """Rows (N,) whose distance from the instrument was measured."""
        return self.of_kind(DISTANCE)

    @property
    def stated(self) -> np.ndarray:
        """Rows (N,) whose noise is stated."""
        return np.full(len(self), self.sigma_given) if self.unstated is None else ~self.unstated

    @property
    def located(self) -> np.ndarray:
        """Rows (N,) whose point was measured with all three coordinates by an instrument, which sockets are not."""
        return ~self.in_socket if self.kind is None else ~self.in_socket & (self.kind == "")

    @property
    def places(self) -> tuple[str, ...]:
        """Fixtures, camera's boards, wires and touched faces: stations that robot.yaml does not list, in the order in which they appear."""
        return tuple(dict.fromkeys(self.station[self.seen | ~self.located].tolist()))

    @property
    def turned(self) -> np.ndarray:
        """Rows (N,) whose orientation was measured too."""
        quaternion = self.quaternion_wxyz
        return (
            np.zeros(len(self), bool) if quaternion is None else np.array(np.isfinite(quaternion).all(axis=1))
        )

    @property
    def tilted(self) -> np.ndarray:
        """Rows (N,) at which an inclinometer was read."""
        return self.of_kind(DIRECTION)

    @property
    def angled(self) -> np.ndarray:
        """Rows (N,) that have angles: measured orientations, and readings of inclinometers."""
        return self.turned | self.tilted

    @property
    def pointed(self) -> PoseSet:
        """Rows that say where a target was, which inclinometers do not."""
        return self.subset(~self.tilted) if self.tilted.any() else self

    def without_orientations(self) -> PoseSet:
        """The points alone.

        Returns
        -------
        PoseSet
            The same rows without measured orientations.
        """
        return (
            self
            if self.quaternion_wxyz is None
            else replace(self, quaternion_wxyz=None, orientation_sigma=None, covariance=None)
        )

    @property
    def seen(self) -> np.ndarray:
        """Rows (N,) that a camera measured."""
        return np.zeros(len(self), bool) if self.camera is None else np.array(self.camera != "")

    @property
    def boards(self) -> tuple[str, ...]:
        """Places of a camera's board, or of a camera in the cell, in the order in which they first appear."""
        return tuple(dict.fromkeys(self.station[self.seen].tolist()))

    @property
    def holders(self) -> tuple[str, ...]:
        """Fixtures with sockets by their names under `measurements:`, in the order in which they first appear."""
        return () if self.holder is None else tuple(dict.fromkeys(self.holder[self.in_socket].tolist()))

    @property
    def fixtures(self) -> tuple[str, ...]:
        """Places of a fixture with sockets, in the order in which they first appear."""
        return tuple(dict.fromkeys(self.station[self.in_socket].tolist()))

    @cached_property
    def stations(self) -> tuple[str, ...]:
        """Stations in the order of first appearance."""
        return tuple(dict.fromkeys(self.station.tolist()))

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """Targets in the order of first appearance."""
        return tuple(dict.fromkeys(self.target.tolist()))

    def subset(self, rows: np.ndarray | Sequence[int] | slice) -> PoseSet:
        """Some of the points, in their order.

        Parameters
        ----------
        rows : ndarray, sequence of int or slice
            Indices, or a mask (N,).

        Returns
        -------
        PoseSet
            The points of these rows.
        """
        index = rows if isinstance(rows, slice) else np.asarray(rows)
        if isinstance(index, np.ndarray) and index.size == 0:
            index = np.zeros(0, dtype=int)
        changed: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        for name, value in changed.items():
            if isinstance(value, np.ndarray):
                changed[name] = value[index]
        unstated = changed["unstated"]
        if unstated is not None and (unstated.all() or not unstated.any()):
            changed |= {"unstated": None, "sigma_given": not unstated.all()}
        return PoseSet(**changed)


def concatenate(sets: Sequence[PoseSet]) -> PoseSet:
    """The rows of all sets, in order.

    Where a later set uses a pose number again, its numbers are shifted past the largest so far. Raises `FlexcalError`
    where there is nothing to join, joint counts differ, or only some sets have torques, payload, temperature or time, or some points of an
    instrument a sigma: sockets, lengths and contacts without one are `unstated` beside those. Orientations are NaN where a set has none,
    and the sides from which joints came are not known (0) there.
    """
    if not sets:
        raise FlexcalError("E-POSES-023", "there are no poses to join; give at least one set.")
    if len({poses.q.shape[1] for poses in sets}) > 1:
        counts = ", ".join(str(poses.q.shape[1]) for poses in sets)
        raise FlexcalError(
            "E-POSES-024",
            f"the pose sets have different numbers of joints ({counts}); use sets of one robot.",
        )
    joined: dict[str, Any] = {}
    for entry in fields(PoseSet):
        values = [getattr(poses, entry.name) for poses in sets]
        present = [value is not None for value in values]
        if entry.name == "sigma_given":
            unstated = [poses for poses in sets if not poses.sigma_given]
            if any(values) and any(poses.located.any() for poses in unstated):
                raise FlexcalError("E-POSES-025", _stated_in_part(sets))
            joined[entry.name] = any(values)
        elif entry.name == "unstated":
            joined[entry.name] = _unstated(sets)
        elif entry.name == "notes":
            joined[entry.name] = tuple(note for notes in values for note in notes)
        elif entry.name == "lenses":
            joined[entry.name] = {name: lens for one in values for name, lens in one.items()}
        elif entry.name in _PARTIAL and any(present):
            joined[entry.name] = np.concatenate(
                [
                    _absent(entry.name, len(s)) if getattr(s, entry.name) is None else getattr(s, entry.name)
                    for s in sets
                ]
            )
        elif entry.name == "approach" and any(present):
            joined[entry.name] = np.concatenate(
                [np.zeros(s.q.shape) if s.approach is None else s.approach for s in sets]
            )
        elif entry.name == "orientation_sigma" and any(present):
            joined[entry.name] = _orientation_sigmas(sets)
        elif entry.name == "pose":
            joined[entry.name] = _numbered_on(values)
        elif all(present):
            joined[entry.name] = np.concatenate(values)
        elif any(present):
            raise FlexcalError(
                "E-POSES-026",
                f"only {sum(present)} of {len(sets)} pose sets have {entry.name}; give it for all, or for none.",
            )
        else:
            joined[entry.name] = None
    _require_one_fixture(joined["station"], joined["holder"])
    return PoseSet(**joined)


def _stated_in_part(sets: Sequence[PoseSet]) -> str:
    """Sentence on points without a stated noise beside measurements with one."""
    points = [poses for poses in sets if poses.located.any()]
    without = sum(not poses.sigma_given for poses in points)
    if without < len(points):
        return f"{without} of {len(points)} files of points have no sigma, and the others have; give it in all, or in none."
    names = dict.fromkeys(
        name
        for poses in sets
        if poses.sigma_given
        for name in (poses.target if poses.tilted.any() else poses.station).tolist()
    )
    return (
        f"the points have no sigma, but the noise of {', '.join(names)} is stated; add a column 'sigma' with the instrument's standard "
        "deviation in m to the points, or leave the other out too (`std:` under `measurements:` in robot.yaml, or its column)."
    )


def _require_one_fixture(station: np.ndarray, holder: np.ndarray | None) -> None:
    """Raise `FlexcalError` where two fixtures have a place of one name."""
    first: dict[str, str] = {}
    for place, name in zip(station.tolist(), [] if holder is None else holder.tolist(), strict=False):
        if name and first.setdefault(place, name) != name:
            raise FlexcalError(
                "E-POSES-077",
                f"'{place}' is a place of {first[place]} and of {name}; give every place of each fixture a name of its own.",
            )


_PARTIAL: dict[str, tuple[tuple[int, ...], float | str]] = {
    "socket": ((), ""),
    "holder": ((), ""),
    "camera": ((), ""),
    "kind": ((), ""),
    "tilt": ((3,), np.nan),
    "force": ((3,), 0.0),
    "quaternion_wxyz": ((4,), np.nan),
    "covariance": ((6, 6), np.nan),
    "by_lens": ((6, 9), 0.0),
}
"""Fields that some sets may lack: shape of a row, and its value there."""


def _absent(field: str, rows: int) -> np.ndarray:
    shape, value = _PARTIAL[field]
    return np.full((rows, *shape), value)


def _orientation_sigmas(sets: Sequence[PoseSet]) -> np.ndarray:
    without = [s for s in sets if s.orientation_sigma is None]
    if any(s.turned.any() for s in without):
        raise FlexcalError(
            "E-POSES-042",
            "only some pose sets have orientation_sigma; give it for all orientations, or for none.",
        )
    return np.concatenate(
        [np.full(len(s), np.nan) if s.orientation_sigma is None else s.orientation_sigma for s in sets]
    )


def _unstated(sets: Sequence[PoseSet]) -> np.ndarray | None:
    """Rows without a stated noise where other rows have one."""
    own = [np.full(len(s), not s.sigma_given) if s.unstated is None else s.unstated for s in sets]
    rows = np.concatenate(own)
    return rows if rows.any() and not rows.all() else None


def _numbered_on(numbers: Sequence[np.ndarray]) -> np.ndarray:
    joined = numbers[0]
    for later in numbers[1:]:
        if np.isin(later, joined).any():
            later = later - later.min() + joined.max() + 1
        joined = np.concatenate([joined, later])
    return joined
