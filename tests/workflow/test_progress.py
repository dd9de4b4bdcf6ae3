"""Every stage of a job tells when it begins, how far it is, and when it ends."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexcal.workflow.design_poses import plan_calibration_poses


@pytest.mark.parametrize("criterion", ["c", "E"])
def test_design_of_poses(examples: Path, tmp_path: Path, criterion: str) -> None:
    told: dict[str, list[float]] = {}
    plan_calibration_poses(
        examples / "tx90l" / "robot.yaml",
        tmp_path / "plan.yaml",
        20,
        criterion=criterion,
        candidates=200,
        progress=lambda stage, share: told.setdefault(stage, []).append(share),
    )
    assert list(told) == ["candidates", "choosing", "how many"]
    for stage, shares in told.items():
        assert shares[0] == 0.0 and shares[-1] == 1.0 and shares == sorted(shares), stage
    assert sum(0 < share < 1 for share in told["choosing"]) >= 2
