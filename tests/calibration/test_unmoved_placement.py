"""Probability of a placement of the instrument where it was not moved."""

import numpy as np

from flexcal.calibration.verification import ErrorCovariance
from flexcal.calibration.verification.refitted_placement import _unmoved


def test_the_probability_is_uniform_where_nothing_was_moved_and_small_where_something_was() -> None:
    rng = np.random.default_rng(3)
    poses, parameters = 20, 9
    roots = 3e-4 * rng.standard_normal((poses, 3, parameters))
    covariance = ErrorCovariance(roots, 0, np.broadcast_to(1e-9 * np.eye(3), (poses, 3, 3)))
    basis = np.linalg.qr(rng.standard_normal((3 * poses, 6)))[0]
    errors = rng.standard_normal((2000, parameters)) @ roots.reshape(3 * poses, -1).T
    errors += np.sqrt(1e-9) * rng.standard_normal((2000, 3 * poses))
    found = np.array([_unmoved(basis, own, covariance, 0.0) for own in errors])
    for share in (0.01, 0.1, 0.5):
        assert abs(np.mean(found < share) - share) < 4 * np.sqrt(share * (1 - share) / 2000)
    assert max(_unmoved(basis, own + 0.05 * basis[:, 0], covariance, 0.0) for own in errors) < 1e-3
