"""Placement of the instrument: the probability of one that was not moved, and points on a line."""

import numpy as np
from refusals import refused

from flexcal import rigid_motion
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


def test_points_on_a_line_are_said_to_be_measured_or_of_the_model() -> None:
    rng = np.random.default_rng(5)
    spread, line = rng.normal(size=(8, 3)), rng.normal(size=(8, 1)) * [1.0, 2.0, 0.5]
    with refused("E-CAL-016", "line as measured"):
        rigid_motion(spread, line, "tracker")
    with refused("E-CAL-016", "line by the robot's model alone"):
        rigid_motion(line, spread, "tracker")
