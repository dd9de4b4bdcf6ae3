"""`flexcal export xacro`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.arguments.shared_options import (
    Estimates,
    Folder,
    Json,
    MaybePath,
    Robot,
    Temperature,
    Texts,
    require_robot,
)
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted

_LISTED = 6
_SEPARATORS = {"arguments": ":=", "packages": "="}


@dataclass(frozen=True)
class ExportXacro:
    """Write the files of the robot's description with calibrated numbers: macros, comments, properties and white space stay.

    Numbers are changed where they are written: in origins, in a property, argument or YAML value that makes one of them alone, and else
    in an overlay file that the origins look up by the name of the joint. The result is expanded and compared with the calibrated robot.

    A description cannot represent deflection, backlash and transmission error; the resulting error is printed in millimetres. Points of
    robot.yaml have no place in it and are printed.
    """

    robot: Robot
    out: Annotated[Folder, arg(help="Folder for the files, as they lie to each other.")]
    xacro: Annotated[
        MaybePath, arg(metavar="FILE", help_behavior_hint="(default: the URDF of robot.yaml)")
    ] = None
    """The xacro file, or URDF, that the URDF of robot.yaml was made of."""
    arguments: Annotated[Texts, arg(metavar="NAME:=VALUE...", help_behavior_hint="")] = ()
    """Arguments of the xacro file."""
    packages: Annotated[Texts, arg(metavar="NAME=FOLDER...", help_behavior_hint="")] = ()
    """Folders of ROS packages that $(find NAME) means, where ROS does not know them."""
    zeros: Literal["origins", "ros2_control"] = "origins"
    """Where the offsets of the joints go: into the origins, or as <param name="offset"> into <ros2_control>, with all limits moved."""
    joint_limits: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """MoveIt's joint_limits.yaml: its positions move with the offsets in ros2_control."""
    temperature: Temperature = None
    estimates: Estimates = None
    json: Json = False

    def run(self) -> None:
        """Export, and print what each file got and the error due to terms that no description has."""
        from flexcal.jobs.deployment import export_xacro

        require_robot(self.robot)
        console = Console(self.json)
        exported = export_xacro(
            self.robot,
            self.out,
            xacro=self.xacro,
            arguments=_named(self.arguments, "arguments"),
            packages={name: Path(value) for name, value in _named(self.packages, "packages").items()},
            zeros=self.zeros,
            joint_limits=self.joint_limits,
            temperature=self.temperature,
            estimates=self.estimates,
        )
        document = exported.document()
        for item in document["files"]:
            if item["changes"]:
                more = len(item["changes"]) - _LISTED
                said = "; ".join(item["changes"][:_LISTED]) + (f"; {more} more in --json" if more > 0 else "")
                console.say(f"{item['file']}: {said}")
        console.say(
            f"wrote {len(document['files'])} files to {self.out}, {len(exported.changes)} of them changed"
        )
        for sentence in (*exported.loss.sentences, *exported.remarks):
            console.say(sentence)
        for name, point in document["points"].items():
            xyz, rpy = (" ".join(f"{value:.6f}" for value in point[key]) for key in ("xyz", "rpy"))
            console.say(f"the point '{name}' is in no file: in {point['link']} it is at xyz {xyz}, rpy {rpy}")
        following = f"compare {self.out} with the files in use, and load {self.out / document['main']}"
        if not exported.calibrated:
            console.say("there is no calibration: the joint placements are nominal")
            following = f"flexcal calibrate {quoted(self.robot)} POSES…, and export again"
        console.finish(document, following)


def _named(texts: Sequence[str], option: str) -> dict[str, str]:
    separator = _SEPARATORS[option]
    result = {}
    for text in texts:
        name, found, value = text.partition(separator)
        if not found or not name:
            raise InputError(
                "E-ROS-018", f"--{option}: '{text}' is not NAME{separator}VALUE; write it like that."
            )
        result[name] = value
    return result
