"""What a robot carries of earlier estimates, as the prior of a later one."""

from __future__ import annotations

import numpy as np

from flexcal.estimation import Parameter, Parameters
from flexcal.model.robot import Posterior


def test_estimated_parameters_keep_their_joint_covariance() -> None:
    """Of three declared ones two were estimated together; one was only held, and one on another scale, which is another coordinate."""
    covariance = np.array(
        [[4.0, 3.0, 0.0, 0.0], [3.0, 9.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )
    names = ("a", "b", "held", "scaled")
    before = Posterior(Parameters(Parameter(n, "kg", 1.0) for n in names), covariance)
    later = Parameters(
        [
            Parameter("b", "kg", 1.0, prior_std=10.0),
            Parameter("held", "kg", 1.0, prior_std=0.5),
            Parameter("a", "kg", 1.0, prior_std=10.0),
            Parameter("scaled", "kg", 1.0, prior_std=0.1, scale="log"),
            Parameter("new", "kg", 1.0),
        ]
    )
    parameters, joint = before.prior(later)
    expected = np.diag([9.0, 0.25, 4.0, 0.01, np.inf])
    expected[0, 2] = expected[2, 0] = 3.0
    np.testing.assert_allclose(joint, expected, rtol=1e-12)
    np.testing.assert_allclose(parameters.prior_std(), [3.0, 0.5, 2.0, 0.1, np.inf])
