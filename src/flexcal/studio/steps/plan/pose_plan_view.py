"""A plan of poses: table, scene, predicted accuracy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.steps.plan.plan_results import plan_results
from flexcal.studio.steps.plan.plan_view import PlanView
from flexcal.studio.steps.plan.player import Player
from flexcal.studio.steps.plan.pose_checks import PoseChecks
from flexcal.studio.steps.plan.pose_scene import PoseScene
from flexcal.studio.window import ReportFigures, add_sections, add_verdict, joint_unit, paragraph, picked_rows

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.model.robot import RobotModel
    from flexcal.report.layout import Page
    from flexcal.studio.window import Window

_DRAWN_IN_SCENE = "figure-space"
_LEAST = 0.1
"""Seconds of the shortest move."""


class PosePlanView(PlanView):
    """Poses to measure: their order, whether they collide and are seen, and how accurate they let the robot become."""

    def __init__(self, window: Window, model: RobotModel, name: str, plan: PosePlan):
        super().__init__(window, model, name)
        self.plan = plan
        self._keys = [str(number) for number in plan.numbers]
        self._checks = PoseChecks.of(model, plan.q)
        self._results = plan_results(window.project.folder / name)
        self._page = _page(model, plan, self._results)
        self._table = None
        self._row: int | None = None
        self._scene = PoseScene(window, self._checks, self._working(), self._picked)

    def add(self) -> None:
        """Add the verdict of the plan's page, what the checks say, and the selected pose."""
        gui = self.window.gui
        if self._page is not None:
            add_verdict(gui, self._page, tally=False)
        else:
            gui.add_html(
                paragraph(
                    f"{len(self.plan)} poses. What accuracy they allow stands in the page that is written beside a plan, which is missing "
                    "or of another plan: plan again to know it.",
                    "faint",
                )
            )
        enough = self._results.get("enough_poses")
        if enough is not None and self._page is not None:
            gui.add_html(paragraph(_enough(len(self.plan), int(enough))))
        for sentence, tone in self._checks.sentences():
            gui.add_html(paragraph(sentence, tone))
        self._selected = gui.add_html("")
        self._player = Player(self.window, self._checks.checker, repeat=False)
        self._times = _times(self.model, self.plan.q)
        self._player.load(self._times, self.plan.q)
        self.add_link()
        if self._page is not None:
            add_sections(gui, self._page)

    def figures(self) -> Mapping[str, Callable[[], None]]:
        """The table of poses, and the figures of the plan's page."""
        shown = {"Poses": self._add_table}
        if self._page is not None:
            shown["Accuracy"] = self._add_figures
        return shown

    def refresh(self) -> None:
        """Show the selected pose in the table and on the robot."""
        self.window.selection.of(PurePath(self.name).stem)
        key = self.window.selection.key
        row = self._keys.index(key) if key in self._keys else None
        self._scene.select(row)
        if self._table is not None:
            self._table.content = picked_rows(self._columns(), self._rows(), key, height="calc(100vh - 9em)")
        if row is None:
            self._selected.content = paragraph("Pick a pose in the table: the robot goes there.", "faint")
            self._row = None
            return
        if row != self._row:
            self._row = row
            self._player.pause()
            self._player.show(float(self._times[row]))
        touching = "; ".join(f"{one} and {other}" for one, other in self._checks.touching(row))
        if touching:
            self._selected.content = paragraph(f"Pose {key}: {touching} touch.", "bad")
        elif not self._checks.seen[row]:
            self._selected.content = paragraph(f"Pose {key}: the instrument does not see the target.", "bad")
        elif looks := self._checks.looks(row):
            self._selected.content = paragraph(
                f"Pose {key}: collisions are not checked; look: {', '.join(looks)}.", "warning"
            )
        else:
            self._selected.content = paragraph(f"Pose {key} of {len(self.plan)}.")

    def tick(self) -> None:
        """Move on what plays."""
        self._player.tick()

    def close(self) -> None:
        """Stand still, and take targets and instrument out of the scene."""
        self._player.close()
        self._scene.close()

    def _picked(self, row: int) -> None:
        self.window.selection.pick(self._keys[row])

    def _working(self) -> np.ndarray | None:
        """Corners (2, 3), m, of the working volume that the plan is for, where its page tells them."""
        try:
            box = np.array(self._results["working"]["box_m"], dtype=float)
        except (KeyError, TypeError, ValueError):
            return None
        return box if box.shape == (2, 3) else None

    def _add_table(self) -> None:
        self._table = self.window.gui.add_html("")
        self.refresh()

    def _add_figures(self) -> None:
        assert self._page is not None
        blocks = [block for block in self._page.figures if block.id != _DRAWN_IN_SCENE]
        self._figures = ReportFigures(self.window.gui, blocks, dark=self.window.dark)

    def _columns(self) -> tuple[str, ...]:
        units = [joint_unit(joint, "°")[1] for joint in self.model.motor_joints]
        return ("pose", "check", *(f"q{i} / {unit}" for i, unit in enumerate(units, 1)))

    def _rows(self) -> dict[str, tuple[str, ...]]:
        scale = np.array([joint_unit(joint)[0] for joint in self.model.motor_joints])
        return {
            key: (f"pose {key}", self._checks.words(row), *(f"{x:.1f}" for x in self.plan.q[row] / scale))
            for row, key in enumerate(self._keys)
        }


def _page(model: RobotModel, plan: PosePlan, results: dict) -> Page | None:
    """The plan's page from its numbers; None where they are of another plan, or not as this version writes them."""
    from flexcal.report.pages import PoseStudy, pose_page

    if results.get("poses") != len(plan):
        return None
    try:
        return pose_page(PoseStudy(model, plan.q, results))
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _times(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Times (N,), s, at which a robot is in each pose (N, n), moving from one to the next with no joint faster than its limit."""
    velocity = np.array([joint.velocity for joint in model.motor_joints])
    velocity = np.where((velocity > 0) & np.isfinite(velocity), velocity, 1.0)
    moves = (np.abs(np.diff(q, axis=0)) / velocity).max(axis=1)
    return np.concatenate([[0.0], np.cumsum(np.maximum(moves, _LEAST))])


def _enough(planned: int, enough: int) -> str:
    if planned < enough:
        return f"From {enough} poses on, further ones only average noise; these are {planned}, so {enough - planned} more still help."
    return f"From {enough} poses on, further ones only average noise: four times as many halve the error."
