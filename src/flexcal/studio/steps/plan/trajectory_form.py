"""Exciting trajectories."""

from __future__ import annotations

from typing import ClassVar

from flexcal.studio.steps.plan.plan_files import plan_files
from flexcal.studio.steps.plan.plan_form import PlanForm, option
from flexcal.studio.window import add_fold

_CRITERIA = {
    "compound: prior and condition number": "compound",
    "posterior: masses, centres of mass, rotors": "posterior",
    "condition number": "condition",
    "D: volume of the confidence ellipsoid": "D",
    "E: least eigenvalue of the information": "E",
    "A: sum of variances": "A",
    "c: variances of named parameters": "c",
}
_SEQUENCES = {
    "none": None,
    "links, from the last on": "links",
    "wrist and main axes": "axes",
    "inertia, gravity, friction": "kinds",
}
_NONE = "none"


class TrajectoryForm(PlanForm):
    """Motions within all limits that best determine masses, inertias and friction."""

    subject = "Exciting trajectory"
    kind = "trajectory"
    verb = "trajectory"
    button = "Plan trajectories"
    file: ClassVar[str] = "trajectory.yaml"

    def add(self) -> None:
        """Add the fields: number, length and share of the limits; the others folded."""
        fields, gui = self.fields, self.window.gui
        self._count = fields.number(
            "count",
            "Number of trajectories",
            3,
            least=1,
            step=1,
            hint="Each is optimised given those before it.",
        )
        self._duration = fields.number(
            "duration",
            "Duration / s",
            10.0,
            least=1.0,
            step=1.0,
            hint="Of each, without one period to settle.",
        )
        self._share = fields.number(
            "share", "Use of the limits / %", 80.0, least=5.0, most=100.0, step=5.0, hint="The controller needs the rest."
        )  # fmt: skip
        with add_fold(gui, "More"):
            self._criterion = fields.choice(
                "criterion", "Criterion", tuple(_CRITERIA), hint="What is made small."
            )
            self._of = fields.text(
                "of", "Parameters", "", hint="For the criterion c, such as link_3.mass payload.mass."
            )
            self._sequence = fields.choice(
                "sequence", "One for each of", tuple(_SEQUENCES), hint="With the criterion D."
            )
            self._after = fields.choice(
                "after",
                "After",
                (_NONE, *plan_files(self.window.project, "trajectory")),
                hint="A plan that is recorded already.",
            )
            self._kind = fields.choice(
                "kind", "Motion", ("fourier", "spline"), hint="Fourier series, or cyclic B-splines."
            )
            self._frequency = fields.number(
                "frequency",
                "Base frequency / Hz",
                0.2,
                least=0.01,
                step=0.05,
                hint="Its inverse is a period.",
            )
            self._harmonics = fields.number(
                "harmonics", "Harmonics", 5, least=1, step=1, hint="Multiples of the base frequency."
            )
            self._rest = fields.tick("rest", "Begin and end at rest", hint="Every period.")
            self._loaded = fields.tick("loaded", "With the payload", hint="As robot.yaml declares it.")
            self._searches = fields.number(
                "searches", "Searches", 3, least=1, step=1, hint="From random starts; the best is kept."
            )
            self._steps = fields.number(
                "steps",
                "Iterations",
                20,
                least=1,
                step=5,
                hint="40 nearly converge.",
            )
            self._seed = fields.number("seed", "Seed", 0, least=0, step=1, hint="Of the random starts.")
        self._show()

    def options(self) -> tuple[str, ...]:
        """As `PlanForm.options`."""
        criterion, names = _CRITERIA[self._criterion.value], self._of.value.split()
        sequence = _SEQUENCES[self._sequence.value]
        return (
            *option("--count", int(self._count.value), 3),
            *option("--duration", self._duration.value, 10),
            *option("--share", self._share.value / 100, 0.8),
            *(() if criterion == "compound" else ("--criterion", criterion)),
            *(("--of", *names) if criterion == "c" and names else ()),
            *(("--sequence", sequence) if criterion == "D" and sequence is not None else ()),
            *(() if self._after.value == _NONE else ("--after", self._after.value)),
            *(() if self._kind.value == "fourier" else ("--kind", "spline")),
            *option("--base-frequency", self._frequency.value, 0.2),
            *option("--harmonics", int(self._harmonics.value), 5),
            *(("--rest",) if self._rest.value else ()),
            *(("--loaded",) if self._loaded.value else ()),
            *option("--searches", int(self._searches.value), 3),
            *option("--steps", int(self._steps.value), 20),
            *option("--seed", int(self._seed.value), 0),
        )

    def changed(self) -> None:
        """Show the fields that the criterion has."""
        self._show()
        self.show_line()

    def _show(self) -> None:
        criterion = _CRITERIA[self._criterion.value]
        self._of.visible, self._sequence.visible = criterion == "c", criterion == "D"
