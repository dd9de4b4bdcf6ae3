"""Shortest path through all poses: nearest neighbour, then 2-opt (Croes 1958) and or-opt (Or 1976)."""

from __future__ import annotations

import numpy as np

STARTS = 12
"""Number of nearest-neighbour paths that are improved; the shortest counts."""
LONGEST = 3
"""Largest number of places that or-opt moves together."""
_ENOUGH = 1e-9


def shortest_path(cost: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Order (N,) of a short open path, either end free; `cost` (N, N) of moves is symmetric. With `start`, that order improved."""
    count = len(cost)
    if count < 3:
        return np.arange(count)
    closed = np.zeros(
        (count + 1, count + 1)
    )  # an open way is a closed one through a place next to everything
    closed[:count, :count] = cost
    if start is not None:
        starts = [np.append(start, count)]
    else:
        firsts = np.unique(np.linspace(0, count - 1, min(count, STARTS)).round().astype(int))
        starts = [np.append(_nearest(cost, int(first)), count) for first in firsts]
    best = min((_improved(closed, way) for way in starts), key=lambda way: _length(closed, way))
    return np.roll(best, -int(np.flatnonzero(best == count)[0]))[1:]


def _nearest(cost: np.ndarray, first: int) -> np.ndarray:
    left = np.ones(len(cost), dtype=bool)
    way = [first]
    for _ in range(len(cost) - 1):
        left[way[-1]] = False
        way.append(int(np.argmin(np.where(left, cost[way[-1]], np.inf))))
    return np.array(way)


def _length(cost: np.ndarray, way: np.ndarray) -> float:
    return float(cost[way, np.roll(way, -1)].sum())


def _improved(cost: np.ndarray, way: np.ndarray) -> np.ndarray:
    while True:
        before = _length(cost, way)
        way = _or_opt(cost, _two_opt(cost, way))
        if _length(cost, way) > before - _ENOUGH * (1 + before):
            return way


def _two_opt(cost: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Reverse the segment that shortens the closed path most, while one does."""
    way = way.copy()
    upper = np.triu(np.ones((len(way), len(way)), dtype=bool), 1)
    while True:
        after = np.roll(way, -1)
        legs = cost[way, after]
        change = cost[np.ix_(way, way)] + cost[np.ix_(after, after)] - legs[:, None] - legs
        change[~upper] = 0.0
        i, j = np.unravel_index(np.argmin(change), change.shape)
        if change[i, j] > -_ENOUGH * (1 + legs.sum()):
            return way
        way[i + 1 : j + 1] = way[i + 1 : j + 1][::-1]


def _or_opt(cost: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Move up to three consecutive places elsewhere, in either direction, while that shortens the closed path."""
    tried = 0
    while tried < len(way):
        for size in range(1, min(LONGEST, len(way) - 2) + 1):
            part, rest = way[:size], way[size:]
            after = np.roll(rest, -1)
            open_legs = cost[rest, after]
            saved = cost[rest[-1], part[0]] + cost[part[-1], rest[0]] - open_legs[-1]
            ahead = cost[rest, part[0]] + cost[part[-1], after] - open_legs
            back = cost[rest, part[-1]] + cost[part[0], after] - open_legs
            place = int(np.argmin(np.minimum(ahead, back)))
            if min(ahead[place], back[place]) < saved - _ENOUGH * (1 + abs(saved)):
                turned = part if ahead[place] <= back[place] else part[::-1]
                way = np.concatenate([rest[: place + 1], turned, rest[place + 1 :]])
                tried = 0
                break
        else:
            way = np.roll(way, -1)
            tried += 1
    return way
