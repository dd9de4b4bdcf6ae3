"""Rows measured in the virtual cell."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.steps.measure.row_source import RowSource
from flexcal.studio.window import paragraph

if TYPE_CHECKING:
    from flexcal.data.plans import PosePlan
    from flexcal.data.poses import PoseSet
    from flexcal.model.robot import RobotModel
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.steps.measure.next_pose import NextPose
    from flexcal.studio.window import Window

_UNPLANNED = 1000
"""Added to the number of a pose outside the plan, for the seed of its noise."""


class VirtualSource(RowSource):
    """The virtual cell: planned poses as `flexcal measure PLAN --cell virtual --seed SEED` measures them."""

    title = "virtual cell"

    def __init__(self, window: Window, measuring: Measuring, refresh: Callable[[], None]):
        super().__init__(window, measuring, refresh)
        self._cell = _CellRows()
        self._is_measuring = False
        self._goes_on = False

    def add(self) -> None:
        """Add the seed, and buttons for one pose and for all."""
        gui = self.window.gui
        choices = self.window.choices
        self._seed = gui.add_number("Seed of the hidden truth", choices.number("cell seed", 1), min=0, step=1)
        self._seed.on_update(
            lambda _: self.window.post(lambda: choices.put("cell seed", int(self._seed.value)))
        )
        self.window.button("Measure the next pose (N)", self.measure_next, main=True)
        self._all = self.window.button("Measure all that are left", self._toggle)
        self._told = gui.add_html("")

    def measure_next(self) -> None:
        """Measure the next pose; does nothing while one is being measured."""
        pose, series = self.following, self.measuring.series
        if self._is_measuring:
            return
        if pose is None:
            self._told.content = paragraph(
                "all planned poses are measured."
                if self.measuring.is_complete
                else "choosing the next pose …"
            )
            return
        self._is_measuring = True
        threading.Thread(
            target=self._work, args=(series.model, series.plan, pose, int(self._seed.value)), daemon=True
        ).start()

    def tick(self) -> None:
        """Measure the next pose where all that are left are to be measured."""
        if self._goes_on and self.measuring.is_complete:
            self._toggle()
        if self._goes_on and self.following is not None:
            self.measure_next()

    def _toggle(self) -> None:
        self._goes_on = not self._goes_on
        self._all.label = "Stop measuring" if self._goes_on else "Measure all that are left"

    def _work(self, model: RobotModel, plan: PosePlan | None, pose: NextPose, seed: int) -> None:
        try:
            row = self._cell.row(model, plan, pose, seed)
        except Exception as problem:
            self.window.post(lambda problem=problem: self._failed(problem))
            return
        self.window.post(lambda: self._measured(pose, row))

    def _failed(self, problem: Exception) -> None:
        self._is_measuring = False
        if self._goes_on:
            self._toggle()
        raise problem

    def _measured(self, pose: NextPose, row: PoseSet) -> None:
        from flexcal.jobs.guidance import cells_of

        self._is_measuring = False
        now = self.following
        if now is None or now.number != pose.number:
            return  # another one was chosen meanwhile
        self._told.content = ""
        self.take(cells_of(replace(row, pose=np.array([pose.number]))))


class _CellRows:
    """Rows of the virtual cell; those of a plan are measured together, as their noise is drawn together."""

    def __init__(self) -> None:
        self._of: tuple[object, ...] = ()
        self._rows: PoseSet | None = None

    def row(self, model: RobotModel, plan: PosePlan | None, pose: NextPose, seed: int) -> PoseSet:
        """Row of a pose; raises `FlexcalError` for a robot that cannot be simulated."""
        from flexcal.data.plans import PosePlan
        from flexcal.files.formats import read_yaml
        from flexcal.virtual_cell import CellConfig, VirtualCell

        of = (id(model), id(plan), seed)
        if of != self._of:
            beside = model.path.parent / "cell.yaml"
            config = read_yaml(beside, CellConfig) if beside.is_file() else CellConfig()
            self._held, self._cell = (model, plan), VirtualCell.drawn(model, config, seed)[0]
            self._rows, self._of = None if plan is None else self._cell.measure(plan), of
        if pose.planned and plan is not None and self._rows is not None:
            return self._rows.subset([int(np.flatnonzero(plan.numbers == pose.number)[0])])
        payload = None if pose.payload is None else np.array([pose.payload])
        return self._cell.measure(PosePlan(q=pose.q[None], payload=payload, seed=_UNPLANNED + pose.number))
