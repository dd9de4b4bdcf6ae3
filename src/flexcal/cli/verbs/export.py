"""`flexcal export …`: a verb a format."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import arg

from flexcal.cli.arguments.shared_options import Estimates, Json, MaybeText, Robot, Temperature, require_robot
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.export import FORMATS, PlainFormat
from flexcal.printable import quoted

if TYPE_CHECKING:
    from rich.table import Table

    from flexcal.jobs.deployment import ExportedRobot

_WORTH = 0.9
"""Of the mean error without offsets: what they leave less than is worth entering them."""
Point = Annotated[
    MaybeText,
    arg(metavar="NAME", help="the point at the end of the chain", help_behavior_hint="(default: the first)"),
]


@dataclass(frozen=True)
class Export(ABC):
    """Common part of the export verbs: write the calibrated robot to a file, and report what the format cannot represent."""

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE", help="the file to write")]
    temperature: Temperature = None
    estimates: Estimates = None
    json: Json = False
    geometric: ClassVar[bool] = True

    @abstractmethod
    def write(self) -> ExportedRobot:
        """Write the file."""

    @abstractmethod
    def following(self, document: dict[str, Any]) -> str:
        """Next step with the file."""

    def tables(self, document: dict[str, Any]) -> list[Table]:
        """Tables of the content of the file; `document` as with --json."""
        return []

    def run(self) -> None:
        """Export, and print the error due to terms that the format lacks."""
        require_robot(self.robot)
        console = Console(self.json)
        exported = self.write()
        document = exported.document()
        for table in self.tables(document):
            console.show(table)
        console.say(f"wrote {exported.export.path}")
        for sentence in (*exported.export.loss.sentences, *exported.export.remarks):
            console.say(sentence)
        following = self.following(document)
        if self.geometric and not exported.calibrated:
            console.say("there is no calibration: the joint placements are nominal")
            following = f"flexcal calibrate {quoted(self.robot)} POSES…, and export again"
        console.finish(document, following)


def _plain_export(format: PlainFormat) -> type[Export]:
    """The verb of a format without options of its own."""

    @dataclass(frozen=True)
    class PlainExport(Export):
        def write(self) -> ExportedRobot:
            from flexcal.jobs.deployment import export_stored_robot

            return export_stored_robot(
                self.robot, self.out, format.name, estimates=self.estimates, temperature=self.temperature
            )

        def following(self, document: dict[str, Any]) -> str:
            return format.following.format(out=self.out)

    PlainExport.__doc__ = format.details
    return PlainExport


globals().update(
    (f"Export{format.name.capitalize()}", _plain_export(format))
    for format in FORMATS
    if isinstance(format, PlainFormat)
)


@dataclass(frozen=True)
class ExportDh(Export):
    """Write the standard Denavit-Hartenberg table of the chain to a point as CSV, nominal beside calibrated.

    A row is Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta). beta (Hayati) replaces d between nominally parallel axes, which have no unique
    common normal.
    """

    format: ClassVar[str] = "dh"
    point: Point = None
    four_parameters: bool = False
    """Never use beta, for controllers with four parameters per joint; the tilt of nominally parallel axes about y is left out."""

    def write(self) -> ExportedRobot:
        from flexcal.jobs.deployment import export_stored_robot

        return export_stored_robot(
            self.robot,
            self.out,
            self.format,
            point=self.point,
            four_parameters=self.four_parameters,
            estimates=self.estimates,
            temperature=self.temperature,
        )

    def following(self, document: dict[str, Any]) -> str:
        if not document["safe"]:
            return f"compare the nominal values of {self.out} with the controller's before entering anything: see above"
        return f"where the controller has the nominal values of {self.out}, enter the calibrated ones, base and tool too"

    def tables(self, document: dict[str, Any]) -> list[Table]:
        from flexcal.cli.tables.export import dh_table, frame_table

        frames = {name: document[name]["calibrated"] for name in ("base", "tool")}
        return [dh_table(document), frame_table(frames)]


@dataclass(frozen=True)
class ExportMdh(ExportDh):
    """Write the modified Denavit-Hartenberg table (Craig; Khalil, Kleinfinger) of the chain to a point as CSV, nominal beside calibrated.

    A row is Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d). beta (Hayati) replaces d between nominally parallel axes, which have no unique
    common normal.
    """

    format: ClassVar[str] = "mdh"


@dataclass(frozen=True)
class ExportIsaac(Export):
    """Write the actuators that 'identify actuators' found as JSON, in the words of Isaac Lab and PACE.

    Keyword arguments of DelayedPDActuatorCfg (stiffness, damping, armature, friction, dynamic_friction, viscous_friction, effort_limit,
    delays in time steps), and PACE's vector of parameters.
    """

    geometric: ClassVar[bool] = False
    time_step: float = 0.005
    """Time step of the simulation, s, in which delays are counted."""

    def write(self) -> ExportedRobot:
        from flexcal.jobs.deployment import export_stored_robot

        if not 1e-5 <= self.time_step <= 0.1:
            raise InputError(
                "E-CLI-045",
                f"--time-step is in s, between 0.00001 and 0.1, not {self.time_step:g}; give that of the simulation.",
            )
        return export_stored_robot(
            self.robot,
            self.out,
            "isaac",
            time_step=self.time_step,
            estimates=self.estimates,
            temperature=self.temperature,
        )

    def following(self, document: dict[str, Any]) -> str:
        return (
            f"give each group of {self.out} to DelayedPDActuatorCfg(**group) of Isaac Lab: docs/simulators.md"
        )


@dataclass(frozen=True)
class ExportOffsets(Export):
    """Write the joint offsets with the smallest tool error, for controllers that accept nothing else, as CSV.

    They are fitted to the calibrated robot at rest over random poses, of the working volume where robot.yaml declares one, so that the
    remaining error is smallest. Base and tool are fitted with them.
    """

    point: Point = None
    keep_frames: bool = False
    """Leave base and tool as they are nominally, and fit the offsets alone."""

    def write(self) -> ExportedRobot:
        from flexcal.jobs.deployment import export_stored_robot

        return export_stored_robot(
            self.robot,
            self.out,
            "offsets",
            point=self.point,
            keep_frames=self.keep_frames,
            estimates=self.estimates,
            temperature=self.temperature,
        )

    def following(self, document: dict[str, Any]) -> str:
        frames = "" if self.keep_frames else ", and set base and tool as it says"
        if not document["safe"]:
            return f"find out why offsets of {self.out} are so large before adding any to the joint zeros: see above"
        error, without = document["tool_error"], document["without_offsets"]
        if error["mean_mm"] > _WORTH * without["mean_mm"]:
            robot = quoted(self.robot)
            return f"offsets alone improve little here: flexcal export mdh {robot}, or flexcal compensate {robot} TARGETS.csv"
        return f"add the offsets of {self.out} to the joint zeros of the controller{frames}"

    def tables(self, document: dict[str, Any]) -> list[Table]:
        from flexcal.cli.tables.export import frame_table, offset_table

        if self.keep_frames:
            return [offset_table(document)]
        return [offset_table(document), frame_table({name: document[name] for name in ("base", "tool")})]


@dataclass(frozen=True)
class ExportRuntime(Export):
    """Write the calibrated robot for the C++ runtime of flexcal (runtime/), which compensates in the control loop, without Python.

    The file is JSON, or, where it is called .h or .hpp, a header with the same in the constant flexcal_robot. Everything is carried:
    geometry, deflection under gravity and payload, backlash, transmission errors.
    """

    def write(self) -> ExportedRobot:
        from flexcal.jobs.deployment import export_stored_robot

        return export_stored_robot(
            self.robot, self.out, "runtime", estimates=self.estimates, temperature=self.temperature
        )

    def following(self, document: dict[str, Any]) -> str:
        return f"read {self.out} with flexcal::runtime::read_model_file in your program: docs/runtime.md"
