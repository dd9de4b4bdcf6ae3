"""Restricted likelihood by sums over visits and blocks, against the textbook's dense matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from flexcal.calibration.error_model import ErrorComponents, ErrorGroups, LinearFit
from flexcal.calibration.error_model.point_sums import PointSums
from flexcal.calibration.error_model.restricted_likelihood import RestrictedLikelihood
from flexcal.calibration.measurement import METRES, Readings

ONE_POINT = np.arange(30)
SEVERAL_POINTS = np.r_[np.repeat(np.arange(9), 2), np.repeat([9, 10, 11], 3), 12, 12, 13]


ALL_AGAIN = np.arange(30) % 11
SOME_AGAIN = np.r_[np.arange(20), np.arange(10)]
NONE_AGAIN = np.arange(30)


def drawn(visits: np.ndarray, command: np.ndarray = ALL_AGAIN) -> LinearFit:
    """A fit of seven parameters, two of them with a prior, to 30 points with all kinds of shared errors."""
    rng = np.random.default_rng(4)
    cells = ErrorGroups(visits, np.arange(30) // 6, (7 * np.arange(30)) % 4, command)
    sigma = rng.uniform(1e-5, 3e-5, (30, 3))
    parts = (rng.normal(size=(30, 3, k)) for k in (5, 2, 3, 4))
    free, tied, turns, waves = parts
    readings = Readings(np.arange(30), np.full((30, 3), METRES), sigma)
    return LinearFit(4e-5 * rng.normal(size=(30, 3)), free, 1e-5 * tied, waves, readings, turns, cells)


def derivative(fit: LinearFit, name: str) -> np.ndarray:
    """∂V/∂variance of a component (90, 90)."""
    cells = fit.cells
    if name == "robot":
        return np.eye(90)
    if name == "share":
        return np.diag(fit.readings.sigma.ravel() ** 2)
    if name == "transmission":
        return fit.waves.reshape(90, -1) @ fit.waves.reshape(90, -1).T
    labels = cells.pose if name in ("pose", "angular") else cells.blocks[name]
    same = np.kron(labels[:, None] == labels[None], np.ones((3, 3)))
    turns = fit.turns.reshape(90, -1)
    return same * (turns @ turns.T if name == "angular" else np.tile(np.eye(3), (30, 30)))


@pytest.mark.parametrize("visits", [ONE_POINT, SEVERAL_POINTS])
@pytest.mark.parametrize(
    "names",
    [
        ("robot",),
        ("robot", "pose", "angular", "transmission", "workspace", "order", "command"),
        ("robot", "order", "share"),
        ("robot", "transmission", "share"),
    ],
)
@pytest.mark.parametrize("command", [ALL_AGAIN, SOME_AGAIN, NONE_AGAIN])
def test_likelihood_and_its_derivatives(
    visits: np.ndarray, names: tuple[str, ...], command: np.ndarray
) -> None:
    fit = drawn(visits, command)
    stds = dict(zip(names, np.linspace(1e-5, 3e-5, len(names)).tolist(), strict=True)) | {"share": 0.7}
    seen = RestrictedLikelihood.of(PointSums.of(fit), names, ErrorComponents(**stds))
    tied, free, rest = fit.tied.reshape(90, -1), fit.free.reshape(90, -1), fit.residual.ravel()
    whole = 1e-12 * np.eye(90) + tied @ tied.T
    whole += sum(std**2 * derivative(fit, name) for name, std in stds.items())
    inverse = np.linalg.inv(whole)
    information = free.T @ inverse @ free
    projection = inverse - inverse @ free @ np.linalg.solve(information, free.T @ inverse)
    logarithms = np.linalg.slogdet(whole)[1] + np.linalg.slogdet(information)[1]
    assert seen.deviance == pytest.approx(logarithms + rest @ projection @ rest, rel=1e-10)
    pushed = [projection @ derivative(fit, name) for name in names]
    slopes = [np.trace(own) - rest @ own @ projection @ rest for own in pushed]
    np.testing.assert_allclose(seen.slopes, slopes, rtol=1e-8)
    average = [[rest @ a @ b @ projection @ rest for b in pushed] for a in pushed]
    np.testing.assert_allclose(seen.information, average, rtol=1e-8)
    columns = 1e-5 * np.random.default_rng(6).normal(size=(30, 3, 2))
    both = np.c_[columns.reshape(90, 2), rest]
    if "share" not in names and set(fit.cells.blocks) <= set(names):
        products = fit.products(ErrorComponents(**stds), columns)
        np.testing.assert_allclose(products, both.T @ projection @ both, rtol=1e-8)


@pytest.mark.parametrize("visits", [ONE_POINT, SEVERAL_POINTS])
def test_visits_have_the_covariance_of_their_points(visits: np.ndarray) -> None:
    fit = drawn(visits)
    scatter = ErrorComponents(share=1.0, robot=2e-5, pose=3e-5, angular=1e-5)
    jointly = scatter.jointly(fit.readings, fit.turns, fit.cells)
    alone = scatter.independent(fit.readings, fit.turns)
    for rows, block in zip(fit.cells.visits, jointly, strict=True):
        there = np.flatnonzero(rows >= 0)
        for k in there:
            own = block[3 * k : 3 * k + 3]
            np.testing.assert_allclose(own[:, 3 * k : 3 * k + 3], alone[rows[k]])
            for other in there[there != k]:
                turns = fit.turns[rows[k]] @ fit.turns[rows[other]].T
                expected = 9e-10 * np.eye(3) + 1e-10 * turns
                np.testing.assert_allclose(own[:, 3 * other : 3 * other + 3], expected, atol=1e-22)


def test_components_are_those_of_a_search_without_derivatives() -> None:
    """The likelihood is multiplied by the standard deviation of the only model error."""
    fit = drawn(ONE_POINT)
    rng = np.random.default_rng(5)
    wandering = 5e-5 * rng.normal(size=(4, 3))[fit.cells.blocks["order"]]
    fit = replace(fit, residual=fit.residual + wandering, cells=ErrorGroups(ONE_POINT, order=fit.cells.order))
    fit = replace(fit, waves=np.zeros((30, 3, 0)))
    sums = PointSums.of(fit)

    def deviance(x: np.ndarray) -> float:
        scatter = ErrorComponents(share=1.0, robot=float(x[0]) * 1e-5, order=float(x[1]) * 1e-5)
        return RestrictedLikelihood.of(sums, ("order",), scatter).deviance - 2 * np.log(abs(x[1]))

    best = minimize(deviance, [3.0, 3.0], method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-10})
    found, _ = fit.scatter(stated=True)
    assert found.angular == 0
    np.testing.assert_allclose([found.robot, found.order], 1e-5 * np.abs(best.x), rtol=1e-4)


@pytest.mark.parametrize("share", [0.3, 1.0, 3.0])
def test_a_component_far_from_zero_would_have_passed_the_trial(share: float) -> None:
    """Scatter of the joints from a little to most of the whole: the likelihood falls by far more than 2.7 without it."""
    rng = np.random.default_rng(7)
    visits = np.arange(300)
    readings = Readings(visits, np.full((300, 3), METRES), np.zeros((300, 3)))
    free, turns = rng.normal(size=(300, 3, 5)), rng.normal(size=(300, 3, 4))
    turned = np.matmul(turns, 2e-5 * np.sqrt(share) * rng.normal(size=(300, 4, 1)))[:, :, 0]
    residual = 2e-5 * rng.normal(size=(300, 3)) + turned
    nothing = np.zeros((300, 3, 0))
    fit = LinearFit(residual, free, nothing, nothing, readings, turns, ErrorGroups(visits))
    found, spread = fit.scatter(stated=False)
    assert found.angular > 12 * spread["angular"]
    alone = replace(fit, turns=np.zeros_like(turns)).scatter(stated=False)[0]
    assert alone.angular == 0
    names = ("robot", "angular")
    gain = (log_likelihood(fit, names, found) - log_likelihood(fit, ("robot",), alone)) / 2.7
    assert gain > 5


def log_likelihood(fit: LinearFit, names: tuple[str, ...], scatter: ErrorComponents) -> float:
    return -0.5 * RestrictedLikelihood.of(PointSums.of(fit), names, scatter).deviance
