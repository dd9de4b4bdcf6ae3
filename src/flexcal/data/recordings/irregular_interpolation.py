"""Interpolation between samples at irregular times."""

from __future__ import annotations

import numpy as np

_NODES = 6
_SIDE = _NODES // 2
_APART = 0.5
"""Least distance of two nodes relative to the interpolated interval: nearer ones would amplify noise by their difference quotients."""


def interpolated(t: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (M, …) at the times `at` (M,) from values (N, …) at ascending times `t` (N,), which enclose them.

    The polynomial of fifth degree through three samples on either side (next to an end through the last six). Between t[i] and t[i + 1] no
    two of its nodes are nearer to each other than half of t[i + 1] - t[i], so that close samples beside a long interval amplify no noise.
    With fewer than six samples the degree is lower.
    """
    n = len(t)
    if n == 1:
        return np.repeat(values, len(at), axis=0)
    first = np.clip(np.searchsorted(t, at, side="right") - 1, 0, n - 2)
    apart = _APART * (t[first + 1] - t[first])
    before, after = [first], [first + 1]
    for _ in range(_NODES - 2):
        last, following = before[-1], after[-1]
        earlier = np.searchsorted(t, t[np.maximum(last, 0)] - apart, side="right") - 1
        later = np.searchsorted(t, t[np.minimum(following, n - 1)] + apart, side="left")
        before.append(np.where(last >= 0, earlier, -1))
        after.append(np.where(following < n, later, n))
    nodes, used = _balanced(np.array(before), np.array(after), n)
    weights = _lagrange(t[nodes] - at, used)
    result = np.zeros((len(at), *values.shape[1:]))
    for node, weight in zip(nodes, weights, strict=True):
        result += weight.reshape(-1, *([1] * (values.ndim - 1))) * values[node]
    return result


def _balanced(before: np.ndarray, after: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Six of the nodes before and after (5, M), as evenly from both sides as there are any, and which of them are used (6, M)."""
    has_before, has_after = (before >= 0).sum(axis=0), (after < n).sum(axis=0)
    from_before = np.minimum(has_before, np.maximum(_SIDE, _NODES - has_after))
    from_after = np.minimum(has_after, _NODES - from_before)
    k = np.arange(_NODES)[:, None]
    most = len(before) - 1
    nodes = np.where(
        k < from_before,
        np.take_along_axis(before, np.clip(from_before - 1 - k, 0, most), axis=0),
        np.take_along_axis(after, np.clip(k - from_before, 0, most), axis=0),
    )
    return np.clip(nodes, 0, n - 1), k < from_before + from_after


def _lagrange(x: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Weights (6, M) of samples `x` (6, M) away; those that are not `used` have none."""
    weights = used.astype(float)
    for j in range(_NODES):
        for i in range(_NODES):
            if i != j:
                both = used[i] & used[j]
                weights[j] *= np.where(both, x[i] / np.where(both, x[i] - x[j], 1.0), 1.0)
    return weights
