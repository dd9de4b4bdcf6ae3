"""The builds of the kernels for different processors, and the triangle that rows are brought into."""

import numpy as np
import pytest

from flexcal import _kernels
from flexcal.kernels import append
from flexcal.model import RobotModel


@pytest.mark.skipif(not _kernels.avx2, reason="this processor runs only one of the builds")
def test_builds_agree_bit_by_bit(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """On what this processor makes of the same tree, regressor with its adjoint, and triangle: else results would depend on the machine."""
    from flexcal import _kernels_avx2

    arm = tx90l.joints
    links = (
        [j.parent for j in arm],
        [j.kind == "prismatic" for j in arm],
        np.array([j.rotation for j in arm]),
        np.array([j.translation for j in arm]),
        np.array([j.normals for j in arm]),
        np.array([np.eye(3)] * len(arm)),
    )
    states = rng.normal(size=(3, 101, 6))
    geometry = 1e-3 * rng.normal(size=(6, 6))
    found = []
    for build in (_kernels, _kernels_avx2):
        out = np.zeros((360, 101))
        places = np.arange(360).reshape(6, 60)
        tree = build.Tree.build(*links)
        tree.torque_regressor(geometry, tx90l.gravity, *states, places, out)
        adjoint = tree.torque_regressor_adjoint(geometry, tx90l.gravity, *states, places, out)
        factor = np.zeros((60, 60))
        build.append(factor, out[:60].copy())
        found.append((out, adjoint, factor))
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert np.abs(found[0][0]).max() > 1.0


@pytest.mark.parametrize("rows", [1, 3, 39, 128, 1001])
def test_the_triangle_is_that_of_numpy(rows: int, rng: np.random.Generator) -> None:
    """Up to signs, which also R of numpy has no rule for; rows come in two parts, and one column is zero."""
    columns = rng.normal(size=(17, 2 * rows))
    columns[5] = 0.0
    factor = np.zeros((17, 17))
    for part in (columns[:, :rows], columns[:, rows:]):
        append(factor, part.copy())
    assert (np.tril(factor, -1) == 0).all()
    np.testing.assert_allclose(factor.T @ factor, columns @ columns.T, rtol=0, atol=1e-12 * 2 * rows)
    if 2 * rows >= 17:
        expected = np.linalg.qr(columns[:5].T, mode="r")
        np.testing.assert_allclose(np.abs(factor[:5, :5]), np.abs(expected), rtol=0, atol=1e-12 * rows)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="triangle must be"):
        append(np.zeros((3, 3)), np.zeros((4, 10)))
    with pytest.raises(TypeError):
        append(np.zeros((3, 3)), np.zeros((10, 3)).T)
