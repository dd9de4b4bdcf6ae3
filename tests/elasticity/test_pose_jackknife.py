"""How far the estimate moves without each pose, against fits without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.elasticity.identification.fit import ResponseData, final_fit, first_fit
from flexcal.elasticity.identification.pose_jackknife import jackknife_std
from flexcal.elasticity.response_model import Tolerances


def test_it_is_the_scatter_of_fits_without_each_pose(
    stiff, poses, synthesise, rng: np.random.Generator
) -> None:
    tolerances = replace(Tolerances.none(), length=3e-4, angle=5e-4)
    responses = [
        replace(synthesise(stiff, q[None], noise=0.01, rng=rng, step=16)[0], pose=k)
        for k, q in enumerate(poses["default"][:4])
    ]

    def fitted(kept: list) -> tuple[np.ndarray, np.ndarray | None]:
        data = ResponseData(tuple(kept), tolerances=tolerances, inertias_known=True)
        fit = final_fit(stiff, data, first_fit(stiff, data, data.parameters(stiff)[0].coordinates()))
        names = [f"joint_{j}.{k}.stiffness" for j in (1, 2, 3) for k in ("drive", "bearing_x", "bearing_y")]
        numbers = [fit.estimate.parameters.index(name) for name in names]
        std = jackknife_std(fit)
        return fit.x[numbers], None if std is None else std[numbers]

    std = fitted(responses)[1]
    without = np.array([fitted(responses[:k] + responses[k + 1 :])[0] for k in range(4)])
    assert std is not None
    np.testing.assert_allclose(std, np.sqrt(3 * np.var(without, axis=0)), rtol=0.35)
    assert fitted(responses[:1])[1] is None
