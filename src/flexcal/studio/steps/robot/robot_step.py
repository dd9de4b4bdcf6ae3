"""The robot: its URDF, measured points, payload and instrument."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import read_yaml_file
from flexcal.jobs.setup import FileProblem, description_problems, urdf_robot
from flexcal.model.robot import RobotModel
from flexcal.studio.project import Project
from flexcal.studio.server import limit_uploads
from flexcal.studio.steps.robot.joint_sliders import JointSliders, slider_units
from flexcal.studio.steps.robot.place_editor import PlaceEditor
from flexcal.studio.steps.robot.places import places_of
from flexcal.studio.steps.robot.problem_listing import problem_listing
from flexcal.studio.steps.robot.robot_file import RobotFile
from flexcal.studio.steps.robot.uploads import LARGEST, require_size
from flexcal.studio.steps.robot.urdf_choice import UrdfChoice
from flexcal.studio.window import Place, Step, Window, add_fold, facts, paragraph

if TYPE_CHECKING:
    from flexcal.studio.scene import MeshNotDrawn

_SHOWN = ("robot.yaml", ".urdf", ".stl", ".obj", ".dae")
"""Endings of the files that the step shows."""


class RobotStep(Step):
    """The robot: its URDF, measured points, payload and instrument."""

    title = "Robot"

    def __init__(self, window: Window):
        super().__init__(window)
        self._shown: object = None
        self._sliders: JointSliders | None = None
        self._editor: PlaceEditor | None = None
        self._bare: RobotModel | None = None
        self._file = RobotFile(window)
        limit_uploads(
            window.server, LARGEST, lambda name, size: window.post(lambda: require_size(name, size))
        )

    def open(self) -> None:
        """Add the place for what the folder allows."""
        self._shown = None
        self._place = Place(self.window.gui)

    def refresh(self) -> None:
        """Show the robot of the folder: of robot.yaml, with all of its problems, else of the chosen URDF."""
        files = [entry for entry in self.window.project.stamp() if entry[0].lower().endswith(_SHOWN)]
        stamp = (files, self.window.choices.get("urdf", ""), self.window.choices.get("tip", ""))
        if stamp != self._shown:
            self._shown = stamp
            self._rebuild()
        elif self._bare is not None:
            self.window.robot.show(self._bare)

    def tick(self) -> None:
        """Let markers follow the robot."""
        if self._editor is not None:
            self._editor.follow()

    def close(self) -> None:
        """Take the markers out of the scene."""
        if self._editor is not None:
            self._editor.close()
        self._editor = self._sliders = self._bare = None

    def _rebuild(self) -> None:
        self.close()
        with self._place.anew():
            if self.window.project.robot_file.is_file():
                self._show_description()
            else:
                self._show_start()

    def _show_start(self) -> None:
        """Without robot.yaml: a URDF is chosen and looked at."""
        window, gui = self.window, self.window.gui
        said = gui.add_html("")
        choice = UrdfChoice(window, described=False, changed=self.refresh)
        if choice.urdf is None:
            said.content = paragraph(
                "Begin here: upload the robot's URDF, copy it into the folder, or take an example. URDFs come with the robot's ROS "
                "description package."
            )
            return
        try:
            model = urdf_robot(window.project.folder / choice.urdf, choice.tip)
        except FlexcalError as problem:
            said.content = paragraph(window.project.told(f"{problem} [{problem.code}]"), "bad")
            return
        said.content = paragraph(
            "Look at the robot and move its joints. If it is the right one, create robot.yaml: the file that says what is measured, "
            "what the robot holds and where the instrument stands."
        )
        self._bare = model
        window.robot.show(model)
        self._show_robot(model)

    def _show_description(self) -> None:
        """With robot.yaml: its problems, or the robot."""
        window, gui = self.window, self.window.gui
        problems = description_problems(window.project.robot_file)
        if problems:
            gui.add_html(_broken(problems) + problem_listing(problems, window.project.folder))
            self._show_bare()
            self._show_files()
            return
        model = window.model(estimates=False)
        gui.add_html(_next(model))
        with gui.add_folder("Measured points, payload, instrument"):
            self._editor = PlaceEditor(window, model, self._file)
        self._show_robot(model)
        self._show_files()

    def _show_bare(self) -> None:
        """While robot.yaml has problems: the robot as its URDF describes it, where that can be read."""
        urdf = _named_urdf(self.window.project)
        if urdf is None:
            return
        try:
            self._bare = urdf_robot(urdf)
        except FlexcalError:
            return
        self.window.robot.show(self._bare)
        self.window.gui.add_html(
            paragraph("Until then the robot is shown as the URDF alone describes it.", "faint")
        )
        self._show_robot(self._bare)

    def _show_robot(self, model: RobotModel) -> None:
        window, gui = self.window, self.window.gui
        gui.add_html(
            facts(
                {
                    "robot": model.name,
                    "URDF": model.urdf.name,
                    "joints with a motor": f"{model.n}",
                    "reach": f"{1000 * model.reach:.0f} mm",
                }
            )
        )
        view = window.robot.view
        if window.robot.problem:
            gui.add_html(paragraph(window.robot.problem, "bad"))
        elif view is not None and view.missing:
            gui.add_html(_missing(view.missing))
        with gui.add_folder(f"Joints / {slider_units(model)}"):
            self._sliders = JointSliders(window, model)

    def _show_files(self) -> None:
        with add_fold(self.window.gui, "Files"):
            UrdfChoice(self.window, described=True, changed=self.refresh)


def _named_urdf(project: Project) -> Path | None:
    """URDF that robot.yaml names, else the first of the folder; None without."""
    try:
        data = read_yaml_file(project.robot_file).data
    except InputError:
        data = None
    name = data.get("robot") if isinstance(data, dict) else None
    names = [name] if isinstance(name, str) else project.files(".urdf")
    return project.folder / names[0] if names else None


def _broken(problems: list[FileProblem]) -> str:
    count = "One problem" if len(problems) == 1 else f"{len(problems)} problems"
    return paragraph(
        f"{count} in the robot's files. Correct robot.yaml in your editor; this page follows when you save.",
        "plain",
    )


def _next(model: RobotModel) -> str:
    """What is there and what to do next, with links."""
    places = places_of(model)
    points = [place for place in places if place.kind == "measured point"]
    if not points:
        return paragraph(
            "The robot is described, but nothing that the instrument sees: add a measured point, such as the centre of the reflector.",
            "warning",
        )
    here = [place.name for place in points if not any(place.xyz)]
    if here:
        return (
            paragraph(
                f"Place {', '.join(here)} where it is on the tool: it is at the origin of its frame. A ruler's centimetre suffices, the "
                "calibration finds the rest.",
                "warning",
            )
            + _links()
        )
    return (
        paragraph(
            f"The robot is described, with {len(points)} measured point{'s' * (len(points) > 1)}.", "good"
        )
        + _links()
    )


def _links() -> str:
    style = "margin:0.2em 0.5em 0.4em;font-size:0.85em;"
    return (
        f'<div style="{style}">Next: <a href="step/Plan">plan the poses</a>, or with measurements at hand '
        '<a href="step/Calibrate">calibrate</a>. <a href="files/robot.yaml" target="_blank" rel="noopener">Read robot.yaml</a></div>'
    )


def _missing(missing: Sequence[MeshNotDrawn]) -> str:
    count = "One mesh of the URDF is" if len(missing) == 1 else f"{len(missing)} meshes of the URDF are"
    listed = "".join(f"<li>{escape(f'{mesh.name}: {mesh.reason}')}</li>" for mesh in missing)
    return (
        paragraph(
            f"{count} not drawn; capsules from joint to joint stand for them, without effect on the calibration. To see the robot as "
            "it looks, copy its description package into the folder beside the URDF, or upload the meshes.",
            "warning",
        )
        + '<details style="font-size:0.8em;margin:0 0.7em 0.4em;"><summary>which, and why</summary>'
        + f'<ul style="overflow-wrap:anywhere;padding-left:1.2em;">{listed}</ul></details>'
    )
