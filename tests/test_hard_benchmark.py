"""What the benchmark over hard robots calls inside, and what confidently wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hard_cell import Judged, clustered_share, table


def test_only_a_trusted_robot_can_be_confidently_wrong() -> None:
    errors = {"mean_mm": 0.1, "p90_mm": 0.2, "max_mm": 0.4}
    good = Judged(
        1,
        "before",
        1.0,
        0.05,
        0.95,
        1.0,
        True,
        (),
        errors,
        errors,
        0.1,
        {"a.stiffness": 0.1},
        {"a.stiffness": 1.0},
        {"a.stiffness": 0.1},
        (1.0, 1.0),
        60.0,
    )
    wrong, refused = replace(good, ratio=1.5, inside=0.8), replace(good, ratio=1.5, inside=0.8, trusted=False)
    assert [r.confidently_wrong for r in (good, wrong, refused)] == [False, True, False]
    page = table([good, wrong, refused])
    assert "2 of 3: 93 to 97 % inside" in page and page.count("confidently wrong") == 1
    assert "2 trusted, 1 of them with observed over predicted above 1.35" in page


def test_coverage_is_counted_by_robot() -> None:
    """Robots that are all inside or all outside say no more than one interval each."""
    hits = [[True] * 10] * 3 + [[False] * 10]
    share, width = clustered_share(hits)
    assert share == 0.75
    assert width == pytest.approx(1.96 * np.sqrt(0.75 * 0.25 / 3))
    assert clustered_share([[True], [True], [True], [False]])[1] == pytest.approx(width)
