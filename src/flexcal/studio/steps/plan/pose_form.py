"""Poses to calibrate on."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from flexcal.studio.project import PLAN, pose_files
from flexcal.studio.steps.plan.plan_form import PlanForm, option
from flexcal.studio.steps.plan.working_fields import WorkingFields
from flexcal.studio.window import add_fold

_BOX = "a box"
_TRACKER = "laser tracker"
_ORIENTATIONS = "tracker of orientations too"
_RANDOM = "random poses"
_CRITERIA = {
    "smallest predicted tool error (c)": "c",
    "A: sum of the parameters' variances": "A",
    "D: volume of the confidence ellipsoid": "D",
    "E: least eigenvalue of the information": "E",
    "O1: observability index": "O1",
    "O2: inverse condition number": "O2",
    "O3: least singular value": "O3",
    "O4: noise amplification": "O4",
    "O5: sum of inverse singular values": "O5",
}


class PoseForm(PlanForm):
    """Poses to calibrate on, chosen for the smallest predicted tool error."""

    subject = "Poses to calibrate on"
    kind = "poses"
    verb = "poses"
    button = "Plan poses"
    file: ClassVar[str] = PLAN

    def add(self) -> None:
        """Add the fields: number, working volume and instrument; the others folded."""
        fields, gui, config = self.fields, self.window.gui, self.model.config
        self._count = fields.number("count", "Number of poses", 40, least=1, step=1, hint="40 by default.")
        self._default = "anywhere" if config.working_volume is None else "as robot.yaml declares"
        tables = pose_files(self.window.project)
        self._working = fields.choice(
            "working",
            "Working volume",
            (self._default, _BOX, *tables),
            hint="Where the tool will work: there the predicted error counts. A table gives points x, y, z or poses.",
        )
        self._box = WorkingFields(self.window, _start(self.model), self.changed)
        self._box.show(self._working.value == _BOX)
        self._measure = fields.choice(
            "measure",
            "Measured with",
            (_TRACKER, _ORIENTATIONS, *config.measurements),
            hint="A name is an instrument of robot.yaml that says where it stands.",
        )
        with add_fold(gui, "More"):
            self._wanted = fields.number(
                "wanted",
                "Stop at error / mm",
                0.0,
                least=0.0,
                step=0.005,
                hint="Fewer poses where this predicted error is reached; 0: all.",
            )
            self._criterion = fields.choice(
                "criterion", "Criterion", tuple(_CRITERIA), hint="What is made small."
            )
            self._pool = fields.choice(
                "pool",
                "Choose from",
                (_RANDOM, *tables),
                hint="Random poses, or those of a table, as poses taught on the robot.",
            )
            self._candidates = fields.number(
                "candidates", "Random candidates", 4000, least=1, step=1000, hint="4000 by default."
            )
            self._payload = None
            if self.model.payload is not None:
                self._payload = fields.number(
                    "payload",
                    "Payload / kg",
                    float(self.model.payload.mass),
                    least=0.0,
                    step=0.5,
                    hint="In these poses.",
                )
            self._seed = fields.number(
                "seed", "Seed", 0, least=0, step=1, hint="Another seed draws other candidates."
            )

    @property
    def note(self) -> str:
        """How many poses are planned: a field that is empty keeps its last number."""
        return f"Plans {int(self._count.value)} poses, also where the field is left empty."

    def options(self) -> tuple[str, ...]:
        """As `PlanForm.options`."""
        working = self._working.value
        place = self._box.option if working == _BOX else working
        measure = {_TRACKER: (), _ORIENTATIONS: ("--measure", "pose")}.get(
            self._measure.value, ("--measure", self._measure.value)
        )
        payload = () if self._payload is None else option("--payload", self._payload.value, self._declared())
        criterion = _CRITERIA[self._criterion.value]
        return (
            *option("--count", int(self._count.value)),
            # '=' since a box may begin with a minus
            *(() if working == self._default else (f"--working={place}",)),
            *measure,
            *option("--wanted", self._wanted.value, 0),
            *(() if criterion == "c" else ("--criterion", criterion)),
            *(() if self._pool.value == _RANDOM else ("--from", self._pool.value)),
            *option("--candidates", int(self._candidates.value), 4000),
            *payload,
            *option("--seed", int(self._seed.value), 0),
        )

    def changed(self) -> None:
        """Show the box where it is chosen."""
        self._box.show(self._working.value == _BOX)
        self.show_line()

    def close(self) -> None:
        """Remove the box."""
        self._box.close()

    def _declared(self) -> float | None:
        return None if self.model.payload is None else float(self.model.payload.mass)


def _start(model) -> np.ndarray:
    """A box to start from: as robot.yaml declares, else before the robot, within reach."""
    declared = model.config.working_volume
    if declared is not None:
        return np.array([declared.lower, declared.upper])
    return model.reach * np.array([[0.35, -0.3, 0.2], [0.7, 0.3, 0.6]])
