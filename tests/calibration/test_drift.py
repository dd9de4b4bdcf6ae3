"""Whether points wandered while they were measured: recovered, and not invented."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from over_seeds import over_seeds

from flexcal.calibration.diagnostics import Drift
from flexcal.calibration.fit import fit_geometry

TRAVEL = np.array([6e-5, -6e-5, 5e-5])


def _drifted(poses, travel):
    share = np.linspace(0, 1, len(poses))
    return replace(poses, position=poses.position + share[:, None] * travel)


def test_a_drift_is_found(simulate, tx90l):
    measured = simulate(3, 60, sigma=3e-5)
    drift = Drift.of(fit_geometry(tx90l, _drifted(measured.poses, TRAVEL)))
    z = np.linalg.solve(np.linalg.cholesky(drift.covariance), drift.travel - TRAVEL)
    assert np.linalg.norm(z) < 4
    assert drift.certain
    assert 0 < np.sqrt(np.trace(drift.covariance)) < 0.4 * drift.distance


def test_what_the_residuals_have_of_it_is_their_own_slope(simulate, tx90l):
    """By a straight line through the residuals that the fit returns; the parameters took up the rest."""
    poses = _drifted(simulate(3, 60, sigma=3e-5).poses, TRAVEL)
    fit = fit_geometry(tx90l, poses)
    drift = Drift.of(fit)
    slope = np.polyfit(np.linspace(0, 1, len(poses)), fit.residuals, 1)[0]
    np.testing.assert_allclose(drift.left, slope, rtol=1e-9, atol=1e-12)
    assert 0 < drift.residual < drift.distance


def test_taking_the_drift_out_leaves_none(simulate, tx90l):
    """The estimate is one step of Gauss-Newton: points less the drift that was found have none, the parameters fitted anew."""
    poses = _drifted(simulate(4, 60, sigma=3e-5).poses, TRAVEL)
    first = Drift.of(fit_geometry(tx90l, poses))
    again = Drift.of(fit_geometry(tx90l, _drifted(poses, -first.travel)))
    assert again.distance < 0.02 * first.distance
    assert not again.certain


def drift_of_an_arm(seed, simulate, tx90l):
    """Squared travel over its covariance of an arm that stays, and whether a drift is certain."""
    drift = Drift.of(fit_geometry(tx90l, simulate(seed, 40, sigma=3e-5).poses))
    return drift.travel @ np.linalg.solve(drift.covariance, drift.travel), drift.certain


@pytest.mark.parametrize(
    ("seeds", "low", "high"), [(8, 0.4, 5.6), pytest.param(24, 1.5, 4.5, marks=pytest.mark.slow)]
)
def test_no_drift_is_invented(simulate, tx90l, seeds, low, high):
    """For an arm that stays, travel over its standard deviation is three standard normal numbers; limits of three sigma for their mean."""
    statistics, flagged = zip(*over_seeds(drift_of_an_arm, range(seeds), simulate, tx90l), strict=True)
    print(f"{np.mean(statistics):.2f}, {sum(flagged)} of {seeds} flagged")
    assert low < np.mean(statistics) < high
    assert sum(flagged) <= 1


def test_outliers_do_not_count(simulate, tx90l):
    poses = simulate(5, 80, sigma=3e-5).poses
    position = poses.position.copy()
    position[-6:] += 5e-3
    drift = Drift.of(fit_geometry(tx90l, replace(poses, position=position), loss="cauchy"))
    assert not drift.certain
