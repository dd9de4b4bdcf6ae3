"""A plan of motions: animated on the robot, and against its limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError
from flexcal.report.layout import FigureBlock, Selector, significant
from flexcal.studio.steps.plan.plan_results import plan_results
from flexcal.studio.steps.plan.plan_view import PlanView
from flexcal.studio.steps.plan.planned_motion import (
    MotionJudge,
    frequency_motions,
    limit_sentence,
    trajectory_motions,
)
from flexcal.studio.steps.plan.player import Player
from flexcal.studio.window import ReportFigures, Tone, facts, paragraph

if TYPE_CHECKING:
    from flexcal.data.plans import MultisinePlan, TrajectoryPlan
    from flexcal.model.robot import RobotModel
    from flexcal.studio.window import Window


class MotionPlanView(PlanView):
    """Exciting trajectories or frequency experiments, moved through on the robot before anything moves."""

    def __init__(self, window: Window, model: RobotModel, name: str, plan: TrajectoryPlan | MultisinePlan):
        super().__init__(window, model, name)
        self.plan = plan
        self._results = plan_results(window.project.folder / name)
        judge = MotionJudge(model, plan.payload)
        self._lacking = judge.lacking
        if plan.kind == "trajectory":
            self._word, self._motions = "trajectory", trajectory_motions(judge, plan)
        else:
            self._word, self._motions = "pose", frequency_motions(judge, plan)
        self._checker = CollisionChecker(model)
        self._collides = {label: self._checker.collides(m.q) for label, m in self._motions.items()}
        self._label = next(iter(self._motions))

    def add(self) -> None:
        """Add what the plan is, what it takes of the limits, and the motion's controls."""
        gui, window = self.window.gui, self.window
        gui.add_html(paragraph(self._headline()))
        sentence, kept = limit_sentence(self._motions, self._word)
        gui.add_html(paragraph(sentence, "good" if kept else "bad"))
        if self._lacking:
            gui.add_html(paragraph(f"Torques are not known: {self._lacking}", "warning"))
        gui.add_html(paragraph(*self._collisions()))
        labels = tuple(self._motions)
        if len(labels) > 1:
            self._choice = gui.add_dropdown(self._word.capitalize(), labels, initial_value=self._label)
            self._choice.on_update(lambda _: window.post(self._choose))
        self._player = Player(window, self._checker, repeat=True)
        known = self._known()
        if known:
            gui.add_html(facts(known))
        for remark in self._results.get("remarks", ()):
            gui.add_html(paragraph(f"{str(remark)[:1].upper()}{str(remark)[1:]}.", "faint"))
        self.add_link()
        self._load()

    def figures(self) -> Mapping[str, Callable[[], None]]:
        """Joints against their limits, and what the plan predicts."""
        shown = {"Limits": lambda: self._add_figures([self._limits()])}
        predicted = self._predicted()
        if predicted:
            shown["Accuracy"] = lambda: self._add_figures(predicted)
        return shown

    def tick(self) -> None:
        """Move on what plays."""
        self._player.tick()

    def close(self) -> None:
        """Stand still."""
        self._player.close()

    def _choose(self) -> None:
        self._label = self._choice.value
        self._load()

    def _load(self) -> None:
        motion = self._motions[self._label]
        self._player.load(motion.time, motion.q)
        self._player.show(0.0)

    def _headline(self) -> str:
        plan = self.plan
        if plan.kind == "trajectory":
            return (
                f"{len(plan)} {'trajectory' if len(plan) == 1 else 'trajectories'} of {plan.periods} periods of "
                f"{1 / plan.base_frequency_hz:g} s: {len(plan) * plan.duration:.0f} s on the robot."
            )
        recordings = len(plan.poses) * plan.recordings_per_pose
        hz = plan.frequencies_hz
        return (
            f"{len(plan.poses)} poses, {len(plan.lines)} lines from {hz[0]:g} to {hz[-1]:g} Hz on {plan.experiments} axes, {recordings} "
            f"recordings: {recordings * plan.duration / 60:.0f} minutes on the robot. The robot swings by "
            f"{np.degrees(plan.reference_amplitude):.1f}° about each pose; the vibration on top is too small to be drawn."
        )

    def _collisions(self) -> tuple[str, Tone]:
        if not self._checker.pairs:
            return (
                "The URDF has no collision shapes, so collisions are not excluded: run the motion in a simulator, or slowly, first.",
                "warning",
            )
        struck = [label for label, mask in self._collides.items() if mask.any()]
        if struck:
            first = self._motions[struck[0]].time[self._collides[struck[0]].argmax()]
            return (
                f"Bodies are in contact, or nearer than 10 mm, in {self._word} {', '.join(struck)}, first at {first:.2f} s.",
                "bad",
            )
        return "No collision with the robot itself, the floor or an obstacle.", "good"

    def _known(self) -> dict[str, str]:
        """Numbers of the plan's page, where there is one."""
        told = {}
        try:
            if self.plan.kind == "trajectory":
                told["Base parameters"] = f"{int(self._results['base_parameters'])}"
                told["Condition number"] = significant(float(self._results["condition"]), 3)
            else:
                largest = self._results["largest_stiffness_std"]
                told["Largest predicted standard deviation"] = (
                    f"{100 * float(largest['std']):.2f} % ({largest['name']})"
                )
        except (KeyError, TypeError, ValueError):
            return {}
        return told

    def _limits(self) -> FigureBlock:
        from flexcal.report.figures import limit_shares

        first = next(iter(self._motions.values()))
        labels = tuple(self._motions)
        shares = {label: motion.shares for label, motion in self._motions.items()}
        return FigureBlock(
            "figure-shares",
            "Joints against their limits",
            limit_shares(
                first.time,
                first.joints,
                {k: {q: np.asarray(v) for q, v in s.items()} for k, s in shares.items()},
            ),
            "Positions from the lower (−100 %) to the upper end of the range; velocities, and motor torques with friction, relative to "
            "the limits of the URDF and of robot.yaml.",
            f"Shares of the limits of {len(first.joints)} joints.",
            (Selector(self._word, "trajectory", labels),) if len(labels) > 1 else (),
        )

    def _predicted(self) -> list[FigureBlock]:
        """Figures of the numbers in the plan's page; none where they are not as this version writes them."""
        from flexcal.report.figures import poses_against_std, predicted_springs, prior_gains

        results = self._results
        try:
            if self.plan.kind == "trajectory":
                gain = {str(name): float(share) for name, share in results["prior_gain"].items()}
                if not gain:
                    return []
                figure = prior_gains(list(gain), np.array(list(gain.values())))
                caption = "Standard deviations with these trajectories, over those of robot.yaml's prior alone; 1 means no information."
                return [
                    FigureBlock(
                        "figure-gain",
                        "Predicted reduction of the standard deviations",
                        figure,
                        caption,
                        caption,
                    )
                ]
            caption = "Farther left is better. Grey: the same poses with the same torque on every line."
            springs = predicted_springs(results["predicted_std"], results["predicted_std_flat"])
            blocks = [
                FigureBlock("figure-springs", "Predicted standard deviations", springs, caption, caption)
            ]
            if "curve" in results:
                curve = np.array(
                    [[p["poses"], p["chosen"], p["random"]] for p in results["curve"]], dtype=float
                ).T
                caption = "Each pose is added to those before it. Grey: the median of poses drawn from the same candidates."
                figure = poses_against_std(curve, len(self.plan.poses))
                blocks.append(FigureBlock("figure-curve", "Number of poses", figure, caption, caption))
            return blocks
        except (KeyError, TypeError, ValueError, AttributeError, FlexcalError):
            return []

    def _add_figures(self, blocks: list[FigureBlock]) -> None:
        ReportFigures(self.window.gui, blocks, dark=self.window.dark)
