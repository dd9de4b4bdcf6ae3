"""Poses to verify on."""

from __future__ import annotations

from typing import ClassVar

from flexcal.studio.project import CHECK_PLAN
from flexcal.studio.steps.plan.plan_form import PlanForm, option

_COUNT, _SEED = 20, 7


class VerificationForm(PlanForm):
    """Random poses over the whole workspace, which the calibration must not know."""

    subject = "Poses to verify on"
    kind = "poses"
    verb = "poses"
    button = "Draw random poses"
    file: ClassVar[str] = CHECK_PLAN

    def add(self) -> None:
        """Add the fields."""
        self._count = self.fields.number(
            "count",
            "Number of poses",
            _COUNT,
            least=1,
            step=1,
            hint="20 tell the mean error to about a tenth.",
        )
        self._seed = self.fields.number(
            "seed", "Seed", _SEED, least=0, step=1, hint="Another seed draws other poses."
        )

    @property
    def note(self) -> str:
        """How many poses are planned: a field that is empty keeps its last number."""
        return f"Plans {int(self._count.value)} poses, also where the field is left empty."

    def options(self) -> tuple[str, ...]:
        """As `PlanForm.options`."""
        return (
            "--random",
            *option("--count", int(self._count.value)),
            *option("--seed", int(self._seed.value), 0),
        )
