"""A target typed in, and its corrected command."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.jobs.inputs import CalibratedRobot, is_station_identified
from flexcal.studio.project import CALIBRATION
from flexcal.studio.scene import BLOCKED, TARGET, Points
from flexcal.studio.steps.verify.corrected_command import CorrectedCommand, TypedTarget
from flexcal.studio.steps.verify.target_file import TargetFile
from flexcal.studio.steps.verify.target_files import target_files
from flexcal.studio.window import Place, Step, Window, joint_unit, paragraph, table
from flexcal.units import DEGREE, MILLIMETRE

_BASE = "the robot's base"
_SAFE, _SHOWN = "far from singular", "as the arm is shown"
_BASE_TOLD = (
    "The base is the nominal robot's, best-fit to the measured points; it is not where a drawing of the cell has it. For a fixture in the "
    "cell choose the instrument's frame, or measure the fixture as a work object ($ flexcal identify frame)."
)
_AT = (400.0, 200.0, 300.0)


class CompensatedTargets(Step):
    """A target typed in, its corrected command and the robot there, the nominal one as a ghost; a file of targets."""

    title = "Compensate"

    def __init__(self, window: Window):
        super().__init__(window)
        self._robot: CalibratedRobot | None = None
        self._mark: Points | None = None
        self._shown: object = None

    def open(self) -> None:
        """Add the places of target, command and file."""
        self._target = Place(self.window.gui)
        self._command = Place(self.window.gui)
        self._file = Place(self.window.gui)
        self._files: list[str] | None = None

    def refresh(self) -> None:
        """Read the calibrated robot and the files of targets where they have changed."""
        window = self.window
        names = target_files(window.project)
        files = [window.project.robot_file, window.project.folder / CALIBRATION / "estimates.yaml"]
        stamp = tuple(path.stat().st_mtime_ns if path.is_file() else None for path in files)
        if stamp != self._shown:
            self._shown = stamp
            self._clear()
            with self._command.anew():
                pass
            self._ask()
        if names != self._files:
            self._files = names
            with self._file.anew(), window.gui.add_folder("Targets of a file"):
                TargetFile(window, names)

    def close(self) -> None:
        """Remove target and ghost from the scene."""
        self._clear()

    def _clear(self) -> None:
        self.window.robot.ghost(None)
        if self._mark is not None:
            self._mark.remove()
            self._mark = None

    def _ask(self) -> None:
        window, gui = self.window, self.window.gui
        with self._target.anew():
            try:
                self._robot = CalibratedRobot.from_yaml(
                    window.project.robot_file, window.project.folder / CALIBRATION
                )
            except FlexcalError as problem:
                gui.add_html(paragraph(self.window.project.told(str(problem)), "bad"))
                return
            model = self._robot.model
            stations = [name for name in model.stations.names if is_station_identified(model, name)]
            self._point = gui.add_dropdown("Point", tuple(model.points))
            self._frame = gui.add_dropdown("Frame", (_BASE, *stations))
            self._told_frame = gui.add_html(paragraph(_BASE_TOLD, "faint"))
            self._frame.on_update(lambda _: window.post(self._tell_frame))
            self._position = gui.add_vector3("xyz / mm", self._kept("target position", _AT), step=0.001)
            self._oriented = gui.add_checkbox("Turned", window.choices.get("target oriented", False))
            self._rpy = gui.add_vector3(
                "rpy / deg",
                self._kept("target rpy", (180.0, 0.0, 0.0)),
                step=0.001,
                visible=self._oriented.value,
            )
            self._convention = gui.add_html(
                paragraph(
                    "rpy: roll, pitch, yaw of the point's frame as in a URDF, turned about the fixed x, then y, then z.",
                    "faint",
                ),
                visible=self._oriented.value,
            )
            self._start = gui.add_dropdown("Start", (_SAFE, _SHOWN), hint="of the inverse kinematics")
            self._oriented.on_update(lambda _: window.post(self._orient))
            for field in (self._position, self._rpy):
                field.on_update(lambda _: window.post(self._keep))
            window.button(
                "Take the tool's present pose",
                self._take,
                hint="where the nominal robot has the point in the joint positions that are shown, such as those of a selected pose",
            )
            window.button("Correct the command", self._correct, main=True)

    def _kept(self, name: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        kept = self.window.choices.get(name, list(default))
        if len(kept) != 3 or not all(isinstance(value, (int, float)) for value in kept):
            return default
        return float(kept[0]), float(kept[1]), float(kept[2])

    def _keep(self) -> None:
        self.window.choices.put("target position", list(self._position.value))
        self.window.choices.put("target rpy", list(self._rpy.value))

    def _tell_frame(self) -> None:
        self._told_frame.visible = self._frame.value == _BASE

    def _orient(self) -> None:
        self._rpy.visible = self._convention.visible = self._oriented.value
        self.window.choices.put("target oriented", self._oriented.value)

    def _take(self) -> None:
        q = self.window.robot.q
        assert self._robot is not None
        if q is None:
            self.window.say(self.window.robot.problem, "bad")
            return
        target = TypedTarget.of_tool(self._robot.with_points, q, self._point.value)
        assert target.rpy is not None
        self._position.value = _rounded(target.position / MILLIMETRE)
        self._rpy.value = _rounded(target.rpy / DEGREE)
        self._oriented.value, self._frame.value, self._start.value = True, _BASE, _SHOWN
        self._tell_frame()
        self._orient()

    def _correct(self) -> None:
        window = self.window
        assert self._robot is not None
        self._keep()
        target = TypedTarget(
            self._point.value,
            MILLIMETRE * np.array(self._position.value, dtype=float),
            DEGREE * np.array(self._rpy.value, dtype=float) if self._oriented.value else None,
            "" if self._frame.value == _BASE else self._frame.value,
        )
        start = window.robot.q if self._start.value == _SHOWN else None
        self._clear()
        with self._command.anew():
            try:
                found = CorrectedCommand.of(self._robot, target, start)
            except FlexcalError as problem:
                window.gui.add_html(paragraph(window.project.told(f"{problem} [{problem.code}]"), "bad"))
                return
            self._tell(found, based=not target.station)
        window.robot.pose(found.q)
        window.robot.ghost(found.nominal)
        colour = BLOCKED if found.beyond else TARGET
        self._mark = Points(window.scene, found.position[None], colour, name="/target", size=0.03)

    def _tell(self, found: CorrectedCommand, *, based: bool) -> None:
        assert self._robot is not None
        gui, joints = self.window.gui, self._robot.model.motor_joints
        rows = []
        for joint, nominal, q in zip(joints, found.nominal, found.q, strict=True):
            unit, symbol = joint_unit(joint)
            rows.append(
                (
                    f"{joint.name} / {symbol}",
                    f"{nominal / unit:.4f}",
                    f"{q / unit:.4f}",
                    f"{(q - nominal) / unit:+.4f}",
                )
            )
        gui.add_html(table(("joint", "nominal", "corrected", "shift"), rows, height="20em"))
        gui.add_html(
            paragraph(
                f"With the nominal command (the ghost) the tool would be {found.before / MILLIMETRE:.3f} mm from the target."
            )
        )
        if found.mean is not None and found.p95 is not None:
            gui.add_html(
                paragraph(
                    f"With the corrected one its predicted error is {found.mean / MILLIMETRE:.3f} mm on average, "
                    f"{found.p95 / MILLIMETRE:.3f} mm in 95 of 100 cases, from the uncertainty of the calibration"
                    + (", in the base as it is fitted to the measured points." if based else "."),
                    "warning" if found.beyond else "good",
                )
            )
        for remark in found.remarks:
            gui.add_html(paragraph(remark, "warning"))


def _rounded(values: np.ndarray) -> Any:
    return tuple(round(float(value), 4) for value in values)
