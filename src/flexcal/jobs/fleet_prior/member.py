"""A robot of a fleet with one block of its estimates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flexcal.calibration.error_model import TRANSMISSION
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_estimates
from flexcal.jobs.fleet_prior.kinematics import difference
from flexcal.model.robot import RobotModel

FEWEST = 3
"""Least number of robots: two that happen to be alike, or are one that was measured twice, would pass for a model whose robots do not
differ; of three it shows.
"""
FLEET = "fleet"
"""Entry of the provenance of an estimate that had a prior of other robots."""
POOLED: tuple[Block, ...] = ("calibration", "stiffness", "dynamics")
"""Blocks of which a prior has something."""


@dataclass(frozen=True, eq=False)
class Member:
    """A robot of the fleet: nominal `model`, the `estimate` of a `block` and the file of that."""

    name: str
    model: RobotModel
    estimate: Estimate
    source: Path | None = None
    block: Block = "calibration"

    @classmethod
    def read(cls, name: str, robot_file: Path, estimates: Path | None = None) -> dict[Block, Member]:
        """The robot of a robot.yaml, by the blocks that an estimates file, by default its own, has of those that can be pooled."""
        model = RobotModel.from_yaml(robot_file, estimates=False)
        source = estimates or model.estimates_file
        blocks = read_estimates(source) if source.exists() else {}
        return {block: cls(name, model, blocks[block], source, block) for block in POOLED if block in blocks}

    def require_model_of(self, first: Member) -> None:
        """Raises `FlexcalError` where the robot has other kinematics than the `first` of those that are pooled."""
        unlike = difference(first.model, self.model)
        if unlike:
            raise FlexcalError(
                "E-PRIOR-003",
                f"{self.name} is not of the model of {first.name}: {unlike}; pool robots with the same URDF geometry only.",
            )

    @property
    def has_prior(self) -> bool:
        """Whether it was identified with a prior of other robots."""
        return f"input.{FLEET}" in self.estimate.provenance

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms of its calibration, without transmission errors, which are each robot's own."""
        return comparable_terms(self.estimate.provenance.get("option.terms", ""))


def comparable_terms(stored: str) -> tuple[str, ...]:
    """Terms of a calibration that decide what its parameters mean: all but transmission errors, which are waves about the mean."""
    return tuple(sorted(term for term in stored.split() if TRANSMISSION not in term))
