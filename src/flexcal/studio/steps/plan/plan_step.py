"""What to measure: poses, frequency experiments, exciting trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError
from flexcal.studio.project import read_plan_file
from flexcal.studio.steps.plan.frequency_form import FrequencyForm
from flexcal.studio.steps.plan.motion_plan_view import MotionPlanView
from flexcal.studio.steps.plan.plan_files import plan_files
from flexcal.studio.steps.plan.plan_form import PlanForm
from flexcal.studio.steps.plan.plan_view import PlanView
from flexcal.studio.steps.plan.pose_form import PoseForm
from flexcal.studio.steps.plan.pose_plan_view import PosePlanView
from flexcal.studio.steps.plan.trajectory_form import TrajectoryForm
from flexcal.studio.steps.plan.verification_form import VerificationForm
from flexcal.studio.window import Place, Step, Window, add_fold, paragraph

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel

_FORMS: dict[str, type[PlanForm]] = {
    form.subject: form for form in (PoseForm, VerificationForm, FrequencyForm, TrajectoryForm)
}
_NONE = "none yet"


class PlanStep(Step):
    """What to measure: poses, frequency experiments, exciting trajectories; as the robot will move, before it does."""

    title = "Plan"

    def __init__(self, window: Window):
        super().__init__(window)
        self._form: PlanForm | None = None
        self._view: PlanView | None = None
        self._asked: object = None
        self._shown: object = None

    def open(self) -> None:
        """Add the choice of what to plan, the form for it, and the plan."""
        window, gui = self.window, self.window.gui
        self._asked = self._shown = None
        subjects = tuple(_FORMS)
        self._subject = gui.add_dropdown(
            "What to plan", subjects, initial_value=window.choices.among("plan", subjects)
        )
        self._subject.on_update(lambda _: window.post(self._choose))
        self._place = Place(gui)
        self._result = Place(gui)

    def refresh(self) -> None:
        """Show form and plan anew where their files have changed, and the selected pose."""
        project = self.window.project
        robot = self.window.robot.problem
        plans = (
            tuple(plan_files(project, _FORMS[self._subject.value].kind))
            if project.robot_file.is_file()
            else ()
        )
        asked = (
            self._subject.value,
            tuple(project.files(".csv", ".parquet")),
            _stamp(self, ".urdf", "robot.yaml"),
            robot,
        )
        if asked != self._asked:
            self._asked = asked
            self._ask()
        elif self._form is not None:
            self._form.show_line()
        shown = (
            asked,
            plans,
            self._chosen(plans),
            self.window.robot.view,
            _stamp(self, ".urdf", "robot.yaml", *plans),
            self.window.dark,
        )
        if shown != self._shown:
            self._shown = shown
            self._show(plans)
        if self._view is not None:
            self._view.refresh()

    def tick(self) -> None:
        """Move on what moves."""
        if self._view is not None:
            self._view.tick()

    def close(self) -> None:
        """Remove what form and plan show in the scene."""
        self._close_form()
        self._close_view()

    def _choose(self) -> None:
        self.window.choices.put("plan", self._subject.value)
        self.refresh()

    def _ask(self) -> None:
        """The form of what is to be planned; why there is none, where the robot cannot be used."""
        window = self.window
        self._close_form()
        with self._place.anew():
            model = self._model()
            if model is None:
                return
            form = _FORMS[self._subject.value]
            planned = self._chosen(tuple(plan_files(window.project, form.kind)))
            with add_fold(window.gui, "New plan", is_open=not planned):
                self._form = form(window, model)
                window.button(form.button, self._run, main=True)

    def _model(self) -> RobotModel | None:
        gui, project = self.window.gui, self.window.project
        if not project.robot_file.is_file():
            gui.add_html(paragraph("There is no robot.yaml yet: step 1, Robot, makes it.", "warning"))
            return None
        try:
            return self.window.model(estimates=False)
        except FlexcalError as problem:
            gui.add_html(paragraph(project.told(f"{problem} Step 1, Robot, shows it at its line."), "bad"))
            return None

    def _run(self) -> None:
        assert self._form is not None
        out = self._form.out

        def planned(_) -> None:
            self.window.choices.put(self._key, out)

        self.window.command(self._form.arguments, planned)

    @property
    def _key(self) -> str:
        """Name of the choice of the plan that is shown."""
        return f"plan.shown.{self._subject.value}"

    def _chosen(self, plans: tuple[str, ...]) -> str:
        """Name of the plan to show; empty for none."""
        form = _FORMS[self._subject.value]
        chosen = self.window.choices.get(self._key, form.file)
        if chosen in plans:
            return chosen
        return form.file if form.file in plans else ""

    def _show(self, plans: tuple[str, ...]) -> None:
        window = self.window
        self._close_view()
        window.figures.clear()
        chosen = self._chosen(plans)
        with self._result.anew():
            if not plans or self._form is None:
                return
            options = plans if chosen else (_NONE, *plans)
            self._plan = window.gui.add_dropdown("Plan shown", options, initial_value=chosen or _NONE)
            self._plan.on_update(lambda _: window.post(self._choose_plan))
            if not chosen:
                return
            try:
                self._view = self._opened(chosen)
                if self._view is not None:
                    self._view.add()
            except FlexcalError as problem:
                self._view = None
                window.gui.add_html(paragraph(window.project.told(str(problem)), "bad"))
        if self._view is not None:
            window.figures.show(self._view.figures())

    def _opened(self, name: str) -> PlanView | None:
        plan = read_plan_file(self.window.project.folder / name)
        model = self.window.model(estimates=False)
        if plan is None:
            return None
        if plan.joint_count != model.n:
            self.window.gui.add_html(
                paragraph(
                    f"{name} has {plan.joint_count} joints, {model.name} has {model.n}: it is of another robot.",
                    "bad",
                )
            )
            return None
        if plan.kind == "poses":
            return PosePlanView(self.window, model, name, plan)
        return MotionPlanView(self.window, model, name, plan)

    def _choose_plan(self) -> None:
        if self._plan.value != _NONE:
            self.window.choices.put(self._key, self._plan.value)
        self.refresh()

    def _close_form(self) -> None:
        if self._form is not None:
            self._form.close()
            self._form = None

    def _close_view(self) -> None:
        if self._view is not None:
            self._view.close()
            self._view = None


def _stamp(step: PlanStep, *endings: str) -> tuple:
    """Stamp of the files with these endings."""
    return tuple(entry for entry in step.window.project.stamp() if entry[0].endswith(endings))
