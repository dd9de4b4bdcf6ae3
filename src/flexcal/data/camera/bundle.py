"""Camera calibration from views of a board, each at a free pose: intrinsic parameters and poses by least squares (Zhang 2000).

Free poses make what is left a full pose with its covariance, exact to first order: a later fit of robot, camera and board to these poses,
with the intrinsic parameters free within their covariance, is the bundle adjustment of all pixels together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.camera.homography import first_lens, homography, plane_pose
from flexcal.data.camera.lens import projected
from flexcal.errors import FlexcalError
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import LENS

FEWEST_CORNERS = 6
"""Least number of corners of a view."""
_STEPS, _SMALL = 60, 1e-9
_DAMPING = 1e-4
_WRONG = 6.0
"""Residual of a corner, in robust standard deviations, above which its detection is wrong."""
_ROUNDS = 5
_PRIOR = np.array([0.5, 0.5, 0.1, 0.1, 0.5, 1.0, 0.02, 0.02, 2.0])
"""Standard deviations of the intrinsic parameters about the start: of focal length and centre relative to the image's larger side."""


def lens_prior(size: np.ndarray) -> np.ndarray:
    """Standard deviations (9,) of the intrinsic parameters of a camera of which only the `size` (2,) of its images is known, pixels."""
    scale = np.ones(len(LENS))
    scale[:4] = float(size.max())
    return scale * _PRIOR


@dataclass(frozen=True, eq=False)
class View:
    """Corners of a board in one image: `points` (K, 3) on the board, m, and `pixels` (K, 2).

    `edge` is the width of the image's edges, pixels, infinite where it has no contrast; not a number where there is no image.
    """

    name: str
    points: np.ndarray
    pixels: np.ndarray
    edge: float = float("nan")


@dataclass(frozen=True, eq=False)
class FreeViews:
    """Calibrated camera and the pose of the board in each of V views.

    `lens` (9,) with `covariance` (9, 9); `rotation` (V, 3, 3) and `translation` (V, 3), m, of the board in the camera's frame;
    `pose_covariance` (V, 6, 6) of translation, m, and rotation, rad, in the camera's axes at known intrinsic parameters, and `by_lens`
    (V, 6, 9) how these move the estimated pose. `noise` is the standard deviation of a pixel coordinate, `residuals` (V,) its root mean
    square in every view, `wrong` the number of corners left out in each (V,).
    """

    lens: np.ndarray
    covariance: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    pose_covariance: np.ndarray
    by_lens: np.ndarray
    noise: float
    residuals: np.ndarray
    wrong: np.ndarray


def free_views(views: Sequence[View], size: np.ndarray) -> FreeViews:
    """Calibrate a camera whose images have `size` (2,) pixels, width and height, from views of a plane board.

    Corners that deviate by more than six robust standard deviations are left out, the worst of a view first.
    Raises `FlexcalError` for views with fewer than six corners and fewer views than determine the camera.
    """
    for view in views:
        if len(view.points) < FEWEST_CORNERS:
            raise FlexcalError(
                "E-POSES-043",
                f"{view.name} shows {len(view.points)} corners of the board; at least {FEWEST_CORNERS} are needed.",
            )
    if len(views) < 3:
        raise FlexcalError(
            "E-POSES-044", f"there are {len(views)} views of the board; a camera needs at least 3, better 30."
        )
    maps = np.array([homography(view.points[:, :2], view.pixels) for view in views])
    start = first_lens(maps, size)
    poses = [plane_pose(matrix, start) for matrix in maps]
    fit = _Bundle(views, start, np.array([r for r, _ in poses]), np.array([t for _, t in poses]), start, size)
    fit = fit.solved()
    for _ in range(_ROUNDS):
        inside = fit.plausible()
        if inside.sum() == fit.inside.sum():
            break
        fit = fit.without(inside).solved()
    return fit.result()


class _Bundle:
    """Least-squares problem of all pixels, the poses eliminated view by view (Schur complement)."""

    def __init__(
        self,
        views: Sequence[View],
        lens: np.ndarray,
        rotation: np.ndarray,
        translation: np.ndarray,
        start: np.ndarray,
        size: np.ndarray,
        inside: np.ndarray | None = None,
    ) -> None:
        self.views, self.lens, self.rotation, self.translation = views, lens, rotation, translation
        self.start, self.size = start, size
        self.points = np.concatenate([view.points for view in views])
        self.pixels = np.concatenate([view.pixels for view in views])
        counts = [len(view.points) for view in views]
        self.view = np.repeat(np.arange(len(views)), counts)
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self.inside = np.ones(len(self.points), bool) if inside is None else inside
        self.prior = lens_prior(size)

    def with_values(self, lens: np.ndarray, rotation: np.ndarray, translation: np.ndarray) -> _Bundle:
        return _Bundle(self.views, lens, rotation, translation, self.start, self.size, self.inside)

    def without(self, inside: np.ndarray) -> _Bundle:
        return _Bundle(self.views, self.lens, self.rotation, self.translation, self.start, self.size, inside)

    def residual(self) -> np.ndarray:
        """Measured minus projected pixels (N, 2), zero for corners left out."""
        return np.where(
            self.inside[:, None], self.pixels - projected(self._in_camera()[0], self.lens)[0], 0.0
        )

    def _in_camera(self) -> tuple[np.ndarray, np.ndarray]:
        turned = np.matmul(self.rotation[self.view], self.points[:, :, None])[:, :, 0]
        return turned + self.translation[self.view], turned

    def cost(self) -> float:
        """Sum of squares with the weak prior of the lens; infinite where a corner is behind the camera."""
        at, _ = self._in_camera()
        if (at[self.inside, 2] <= 0).any():
            return np.inf
        return float(np.sum(self.residual() ** 2) + np.sum(((self.lens - self.start) / self.prior) ** 2))

    def normal(self) -> tuple[np.ndarray, ...]:
        """Normal equations: of poses (V, 6, 6), of poses and lens (V, 6, 9), of the lens (9, 9), and both right-hand sides."""
        at, turned = self._in_camera()
        pixels, by_point, by_lens = projected(at, self.lens)
        # d(R x + t) = dt + dφ × (R x): a row g of the derivative by the point gives (R x) × g by the rotation
        by_pose = np.concatenate([by_point, np.cross(turned[:, None, :], by_point)], axis=2)
        weight = self.inside[:, None, None]
        by_pose, by_lens = by_pose * weight, by_lens * weight
        residual = np.where(self.inside[:, None], self.pixels - pixels, 0.0)

        def summed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return np.add.reduceat(np.matmul(np.swapaxes(a, 1, 2), b), self.first, axis=0)

        own, across = summed(by_pose, by_pose), summed(by_pose, by_lens)
        lens = np.einsum("nik,nil->kl", by_lens, by_lens, optimize=True) + np.diag(1 / self.prior**2)
        right = summed(by_pose, residual[:, :, None])[:, :, 0]
        right_lens = np.einsum("nik,ni->k", by_lens, residual) - (self.lens - self.start) / self.prior**2
        return own, across, lens, right, right_lens

    def solved(self) -> _Bundle:
        """Solution by Levenberg-Marquardt."""
        at, damping, cost = self, _DAMPING, self.cost()
        for _ in range(_STEPS):
            own, across, lens, right, right_lens = at.normal()
            stepped, after = None, cost
            for _ in range(20):
                held = own * (1 + damping * np.eye(6))
                gain = np.linalg.solve(held, across)
                corner = lens * (1 + damping * np.eye(len(lens))) - np.einsum("vik,vil->kl", across, gain)
                to_lens = np.linalg.solve(corner, right_lens - np.einsum("vik,vi->k", gain, right))
                to_pose = np.linalg.solve(held, right[:, :, None])[:, :, 0] - gain @ to_lens
                turns = np.array([vector_rotation(step) for step in to_pose[:, 3:]])
                tried = at.with_values(
                    at.lens + to_lens, turns @ at.rotation, at.translation + to_pose[:, :3]
                )
                after = tried.cost()
                if after <= cost:
                    stepped = tried
                    break
                damping = max(damping, 1e-10) * 10
            if stepped is None:
                return at
            gained, at, cost, damping = cost - after, stepped, after, damping / 10
            if gained <= _SMALL * cost:
                return at
        return at

    def plausible(self) -> np.ndarray:
        """Corners (N,) that are not wrong; a view keeps its better half at least."""
        at, _ = self._in_camera()
        error = np.linalg.norm(self.pixels - projected(at, self.lens)[0], axis=1)
        scale = float(np.median(error[self.inside])) / np.sqrt(2 * np.log(2))
        return error <= _WRONG * max(scale, 1e-9)

    def result(self) -> FreeViews:
        own, across, lens, _, _ = self.normal()
        residual, kept = self.residual(), int(self.inside.sum())
        noise = float(np.sqrt(np.sum(residual**2) / max(2 * kept - 6 * len(self.views) - len(LENS), 1)))
        variance = max(noise, 1e-6) ** 2
        gain = np.linalg.solve(own, across)
        prior = np.diag(1 / self.prior**2)
        information = (lens - prior - np.einsum("vik,vil->kl", across, gain)) / variance + prior
        counts = np.add.reduceat(self.inside.astype(int), self.first)
        squares = np.add.reduceat(np.sum(residual**2, axis=1), self.first)
        return FreeViews(
            lens=self.lens,
            covariance=np.linalg.inv(information),
            rotation=self.rotation,
            translation=self.translation,
            pose_covariance=variance * np.linalg.inv(own),
            by_lens=-gain,
            noise=noise,
            residuals=np.sqrt(squares / np.maximum(2 * counts, 1)),
            wrong=np.add.reduceat((~self.inside).astype(int), self.first),
        )
