"""Camera and board for which a plan of poses may be: where they stand roughly, poses with the board in view, and what their images tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.kinds import turn_to_z
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.camera import board_corners, lens_prior, projected
from flexcal.data.poses import PoseSet
from flexcal.model.kinematics import damped_step, joint_ranges
from flexcal.model.parts import rotation_wxyz, vector_rotation
from flexcal.model.robot import BOARD_SCALE, LENS, STATION, CameraConfig, RobotModel

_DISTANT, _TILTED = 0.02, 0.02
"""Standard deviations, m and rad, of a place that was measured with a tape."""
_FILLED = (0.35, 1.0)
"""Share of the image's smaller side that the board's larger one takes at the largest and the least distance."""
_STEEPEST = np.deg2rad(55)
"""Largest angle between the board's normal and the line to the camera, beyond which corners are hardly found."""
_AIMED = 0.25
"""Largest deviation of the board's middle from that of the image, relative to the image's sides."""
_MARGIN = 0.01
"""Part of the image along its edges in which no corner counts, relative to its larger side."""
_MOST = 0.6
"""Least share of the corners in an image."""
_STEPS, _LONGEST, _DAMPING = 60, 0.4, 0.02


@dataclass(frozen=True, eq=False)
class CameraSetup:
    """Camera by its `name` under `measurements:`, the corners (K, 3) of its `board` and its `lens` (9,), roughly."""

    name: str
    config: CameraConfig
    board: np.ndarray
    lens: np.ndarray

    touched = True
    tells_base = False

    @classmethod
    def of(cls, name: str, config: CameraConfig) -> CameraSetup:
        """Setup as robot.yaml declares it, with a place in the cell."""
        size = np.array(config.size, dtype=float)
        focal = size.max() if config.focal is None else config.focal
        lens = np.array([focal, focal, *(size / 2), 0, 0, 0, 0, 0])
        return cls(name, config, board_corners(config.board), lens)

    @property
    def on_hand(self) -> bool:
        """Whether the camera is on the hand, not the board."""
        return self.config.mounted == "hand"

    @property
    def stations(self) -> tuple[str, ...]:
        """Name of the place of what stands in the cell."""
        return (self.name,)

    def nuisances(self, target: str) -> dict[str, float]:
        """Parameters of camera and board, and of the axes of what is on the hand, with their standard deviations beforehand."""
        place = {f"station.{self.name}.{key}": _DISTANT for key in STATION[:3]}
        place |= {f"station.{self.name}.{key}": _TILTED for key in STATION[3:]}
        place |= {f"point.{target}.{key}": _TILTED for key in STATION[3:]}
        sizes = lens_prior(np.array(self.config.size, dtype=float))
        lens = {f"camera.{self.name}.{key}": float(std) for key, std in zip(LENS, sizes, strict=True)}
        return place | lens | {BOARD_SCALE: self.config.board.std}

    @property
    def band(self) -> tuple[float, float]:
        """Least and largest distance, m, between camera and board."""
        if self.config.distance is not None:
            return self.config.distance
        filled = self.lens[0] * float(np.ptp(self.board, axis=0).max()) / min(self.config.size)
        return filled / _FILLED[1], filled / _FILLED[0]

    def placed(self, model: RobotModel, target: str) -> RobotModel:
        """Robot with what stands in the cell as a station, and the axes of what is on the hand."""
        here = np.array(self.config.xyz, dtype=float)
        standing, carried = (
            np.array(direction) / np.linalg.norm(direction)
            for direction in (self.config.normal, self.config.axis)
        )
        # z of a camera points where it looks, z of a board into it
        turn = turn_to_z(-standing if self.on_hand else standing)
        numbers = zip(STATION, (*(-vector_rotation(turn) @ here), *turn), strict=True)
        mounted = -turn_to_z(carried if self.on_hand else -carried)
        values = {f"station.{self.name}.{key}": float(value) for key, value in numbers}
        values |= {
            f"point.{target}.r{axis}": float(value) for axis, value in zip("xyz", mounted, strict=True)
        }
        return model.with_stations(self.stations).with_values(values)

    def poses(self, q: np.ndarray, target: str, position: np.ndarray, axes: np.ndarray) -> PoseSet:
        """Pose set of full poses of the target, `position` (N, 3) and `axes` (N, 3, 3) in the axes of what stands in the cell."""
        rows = len(q)
        return PoseSet(
            q=q,
            position=position,
            sigma=np.ones((rows, 3)),
            torque=None,
            payload=None,
            target=np.full(rows, target),
            station=np.full(rows, self.name),
            temperature=None,
            pose=np.arange(rows),
            quaternion_wxyz=rotation_wxyz(axes),
            orientation_sigma=np.ones(rows),
        )

    def _seen(self, placed: RobotModel, q: np.ndarray, target: str) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) and axes (N, 3, 3) of the target at `q` (N, n) in the axes of what stands in the cell."""
        axes = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        at = predict_measurements(placed, self.poses(q, target, np.zeros((len(q), 3)), axes), elastic=False)
        return at.located, at.orientation

    def _in_camera(self, position: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Corners (N, K, 3) before the camera."""
        if self.on_hand:
            return np.matmul(self.board - position[:, None], axes)
        return np.matmul(self.board, np.swapaxes(axes, 1, 2)) + position[:, None]

    def visible(self, model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
        """Mask (N,) of configurations whose image shows the board sharply, most of it, and not too obliquely."""
        position, axes = self._seen(self.placed(model, target), q, target)
        corners = self._in_camera(position, axes)
        middle = corners.mean(axis=1)
        distance = np.linalg.norm(middle, axis=1)
        # the board's z in the camera's axes
        normal = axes[:, 2, :] if self.on_hand else axes[:, :, 2]
        cosine = np.einsum("ni,ni->n", normal, middle) / distance
        least, largest = self.band
        shown = self._shown(corners).mean(axis=1) >= _MOST
        return shown & (cosine >= np.cos(_STEEPEST)) & (distance >= least) & (distance <= largest)

    def _shown(self, corners: np.ndarray) -> np.ndarray:
        """Corners (N, K) that are in the image, of those before the camera (N, K, 3)."""
        size, ahead = np.array(self.config.size), corners[:, :, 2] > 1e-3
        depth = np.where(ahead, corners[:, :, 2], 1.0)
        pixels = self.lens[0] * corners[:, :, :2] / depth[:, :, None] + size / 2
        edge = _MARGIN * size.max()
        return ahead & (pixels > edge).all(axis=2) & (pixels < size - edge).all(axis=2)

    def _aims(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Random positions (N, 3) and axes (N, 3, 3) of the target that show the board, in the axes of what stands in the cell."""
        least, largest = self.band
        distance = rng.uniform(least, largest, count)
        aside = rng.uniform(-_AIMED, _AIMED, (count, 2)) * np.array(self.config.size) / self.lens[0]
        ray = np.column_stack([aside, np.ones(count)])
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        # turn of the board's axes before the camera: tilted about an axis across the ray, and about the ray
        tilt = np.arccos(rng.uniform(np.cos(_STEEPEST), 1.0, count))
        about, around = rng.uniform(-np.pi, np.pi, (2, count))
        turns = np.empty((count, 3, 3))
        for k in range(count):
            across = vector_rotation(tilt[k] * np.array([np.cos(about[k]), np.sin(about[k]), 0.0]))
            towards = vector_rotation(-turn_to_z(ray[k]))
            turns[k] = towards @ across @ vector_rotation(np.array([0.0, 0.0, around[k]]))
        middle = distance[:, None] * ray
        if not self.on_hand:
            return middle, turns
        back = np.swapaxes(turns, 1, 2)
        return -np.matmul(back, middle[:, :, None])[:, :, 0], back

    def reached(self, model: RobotModel, q: np.ndarray, target: str) -> np.ndarray:
        """Configurations (M, n) near `q` (N, n) that see the board, each at a random distance, angle and place in the image.

        Damped Newton steps end as near to these views as the arm gets; where the board is not seen then, the pose is left out.
        """
        placed, (lower, upper) = self.placed(model, target), joint_ranges(model)
        aims = self._aims(len(q), np.random.default_rng(len(q)))
        offsets = [f"{name}.offset" for name in model.joint_names]
        for _ in range(_STEPS):
            at = predict_measurements(placed, self.poses(q, target, *aims), elastic=False, jacobians=True)
            columns = np.concatenate(np.split(at.jacobian(offsets), 2), axis=1)
            missing = np.concatenate(np.split(at.residual, 2), axis=1)
            step = damped_step(columns, missing, _DAMPING)
            longest = np.abs(step).max(axis=1)
            q = np.clip(
                q + step * np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-12))[:, None], lower, upper
            )
        return q[self.visible(model, q, target)]

    def rows(self, placed: RobotModel, q: np.ndarray, target: str, names: tuple[str, ...]) -> np.ndarray:
        """Rows (N, r, p) of the images at `q` (N, n) in the parameters `names`, in standard deviations of a corner.

        Triangular factors of the derivatives of all pixels by pose, lens and size of the board: the bundle adjustment of all of them.
        """
        position, axes = self._seen(placed, q, target)
        poses = self.poses(q, target, position, axes)
        at = predict_measurements(placed, poses, elastic=False, jacobians=True)
        moving = [name for name in names if name != BOARD_SCALE and not name.startswith("camera.")]
        by_pose = np.concatenate(np.split(at.jacobian(moving), 2), axis=1)
        columns = np.zeros((len(q), 6 + len(LENS) + 1, len(names)))
        columns[:, :6, [names.index(name) for name in moving]] = by_pose
        for k, key in enumerate(LENS):
            columns[:, 6 + k, names.index(f"camera.{self.name}.{key}")] = 1.0
        columns[:, -1, names.index(BOARD_SCALE)] = 1.0
        return np.matmul(self._factors(position, axes), columns)

    def _factors(self, position: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Triangular factors (N, 16, 16) of all pixels by the target's position and rotation, lens and size of the board."""
        corners = self._in_camera(position, axes)
        shown = self._shown(corners)
        flat = np.where(shown[:, :, None], corners, [0.0, 0.0, 1.0]).reshape(-1, 3)
        _, by_point, by_lens = projected(flat, self.lens)
        shape = (*corners.shape[:2], 2, -1)
        by_point, by_lens = by_point.reshape(shape), by_lens.reshape(shape)
        if self.on_hand:
            arm = self.board - position[:, None]
            by_position = -np.matmul(by_point, np.swapaxes(axes, 1, 2)[:, None])
            by_size = np.matmul(self.board, axes)
        else:
            arm = by_size = np.matmul(self.board, np.swapaxes(axes, 1, 2))
            by_position = by_point
        # a rotation dφ of the target moves a corner by -Aᵀ (dφ × arm) before a camera on the hand, by dφ × arm before one in the cell
        by_rotation = np.cross(arm[:, :, None], by_position)
        sized = np.matmul(by_point, by_size[:, :, :, None])
        whole = np.concatenate([by_position, by_rotation, by_lens, sized], axis=3) * shown[:, :, None, None]
        return np.asarray(
            np.linalg.qr(whole.reshape(len(axes), -1, whole.shape[3]) / self.config.std, mode="r")
        )
