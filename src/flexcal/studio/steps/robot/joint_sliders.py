"""The joints on sliders."""

from __future__ import annotations

import math

import numpy as np

from flexcal.model.parts import Joint
from flexcal.model.robot import RobotModel
from flexcal.studio.window import Window, add_fold, joint_unit, table

_FREE_TURN, _FREE_WAY = 180.0, 1000.0
"""Ends of the slider of a joint without limits, deg and mm."""


class JointSliders:
    """A slider a motor, deg (mm where it slides), that moves the robot in the scene; below, the limits of the URDF.

    Parameters
    ----------
    window : Window
        Where it is shown: elements are added at the current place of its GUI.
    model : RobotModel
        The robot that is shown there.
    """

    def __init__(self, window: Window, model: RobotModel):
        self._window, self._model = window, model
        self._units = np.array([joint_unit(joint)[0] for joint in model.motor_joints])
        gui = window.gui
        present = (np.zeros(model.n) if window.robot.q is None else window.robot.q) / self._units
        units = slider_units(model)
        self._sliders = []
        for joint, value in zip(model.motor_joints, present, strict=True):
            lower, upper = slider_range(joint)
            slider = gui.add_slider(
                f"{joint.name} / {joint_unit(joint)[1]}" if units == "deg, mm" else joint.name,
                lower,
                upper,
                0.1,
                float(np.clip(value, lower, upper)),
            )
            slider.on_update(lambda _: window.post(self._moved))
            self._sliders.append(slider)
        window.button("All joints to zero", self._zero, hint="or to the limit nearest to zero")
        with add_fold(gui, "Limits in the URDF"):
            gui.add_html(limits_table(model))

    def _moved(self) -> None:
        self._window.robot.pose(np.array([slider.value for slider in self._sliders]) * self._units)

    def _zero(self) -> None:
        for slider in self._sliders:
            slider.value = float(np.clip(0.0, slider.min, slider.max))
        self._moved()


def slider_units(model: RobotModel) -> str:
    """Units of the sliders: "deg", "mm", or "deg, mm" where some joints turn and some slide."""
    return ", ".join(sorted({joint_unit(joint)[1] for joint in model.motor_joints}))


def slider_range(joint: Joint) -> tuple[float, float]:
    """Lower and upper end of a joint's slider, deg or mm: its limits, half a turn or a metre to both sides without; to 0.01."""
    free = _FREE_WAY if joint.kind == "prismatic" else _FREE_TURN
    unit, _ = joint_unit(joint)
    lower, upper = (
        round(limit / unit, 2) if math.isfinite(limit) else limit for limit in (joint.lower, joint.upper)
    )
    lower, upper = (lower if math.isfinite(lower) else -free), (upper if math.isfinite(upper) else free)
    return (lower, upper) if upper > lower else (lower, lower + 0.1)


def limits_table(model: RobotModel) -> str:
    """HTML of the limits of every joint with a motor."""
    rows = []
    for column, joint in enumerate(model.motor_joints, 1):
        (unit, symbol), force = joint_unit(joint), "N" if joint.kind == "prismatic" else "N m"
        rows.append(
            (
                f"q{column}",
                joint.name,
                _limit(joint.lower / unit, symbol),
                _limit(joint.upper / unit, symbol),
                _limit(joint.velocity / unit, f"{symbol}/s"),
                _limit(joint.effort, force),
            )
        )
    return table(("", "joint", "lower", "upper", "speed", "effort"), rows)


def _limit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}" if math.isfinite(value) else "none"
