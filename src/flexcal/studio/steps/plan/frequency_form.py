"""Frequency experiments."""

from __future__ import annotations

from typing import ClassVar

from flexcal.studio.steps.plan.plan_form import PlanForm, option
from flexcal.studio.window import add_fold

_PLANS = {
    "designed: poses and amplitudes for the springs": "designed",
    "quick: the same in half the time": "quick",
    "default: poses of frequency_poses.csv": "default",
    "paper: no payload, 3° of reference motion": "paper",
}
_GIVEN = ("default", "paper")
_PHASES = {"random phases": "random", "phases of small peaks": "optimised"}
_AMPLITUDES = {"as the plan has it": None, "flat": "flat", "shaped for the springs": "shaped"}


class FrequencyForm(PlanForm):
    """Multisines on every elastic axis, for stiffness and damping."""

    subject = "Frequency experiment"
    kind = "multisine"
    verb = "frequency"
    button = "Plan frequency experiment"
    file: ClassVar[str] = "frequency.yaml"

    def add(self) -> None:
        """Add the fields: plan and number of poses; the others folded."""
        fields, gui = self.fields, self.window.gui
        self._plan = fields.choice("plan", "Plan", tuple(_PLANS), hint="Chosen poses, or those of a file.")
        self._choose = fields.number(
            "choose",
            "Number of poses",
            6,
            least=1,
            step=1,
            hint="A single pose does not determine the springs.",
        )
        self._std = fields.number(
            "std", "Stiffness known to / %", 0.0, least=0.0, step=0.5, hint="Standard deviation of every stiffness that realisations and "
            "periods are chosen for; 0: as the plan has them.",
        )  # fmt: skip
        with add_fold(gui, "More"):
            self._amplitude = fields.choice(
                "amplitude",
                "Amplitudes",
                tuple(_AMPLITUDES),
                hint="The same torque on every line, or more where the springs show.",
            )
            self._crest = fields.choice(
                "crest", "Phases", tuple(_PHASES), hint="Small peaks leave more of the torque limit."
            )
            self._detection = fields.tick(
                "detection",
                "Detection lines",
                hint="One line in four is left out; nonlinear distortion shows there.",
            )
            self._place = fields.tick(
                "place",
                "Payload at other angles",
                hint="Also predict what holding it elsewhere would change.",
            )
            self._candidates = fields.number(
                "candidates", "Random candidates", 300, least=1, step=100, hint="300 by default."
            )
            self._seed = fields.number("seed", "Seed", 0, least=0, step=1, hint="Of poses and phases.")
        self._choose.visible = _PLANS[self._plan.value] not in _GIVEN

    def options(self) -> tuple[str, ...]:
        """As `PlanForm.options`."""
        plan, amplitude = _PLANS[self._plan.value], _AMPLITUDES[self._amplitude.value]
        chosen = plan not in _GIVEN
        return (
            *(() if plan == "default" else ("--plan", plan)),
            *(option("--choose", int(self._choose.value), 6) if chosen else ()),
            *option("--std", self._std.value / 100, 0),
            *(() if amplitude is None else ("--amplitude", amplitude)),
            *(() if _PHASES[self._crest.value] == "random" else ("--crest", "optimised")),
            *(("--detection-lines",) if self._detection.value else ()),
            *(("--place-payload",) if self._place.value else ()),
            *(option("--candidates", int(self._candidates.value), 300) if chosen else ()),
            *option("--seed", int(self._seed.value), 0),
        )

    def changed(self) -> None:
        """Ask for a number of poses only where they are chosen."""
        self._choose.visible = _PLANS[self._plan.value] not in _GIVEN
        self.show_line()
