"""`flexcal filter`."""

from __future__ import annotations

import glob
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybeNumber,
    MaybePath,
    Numbers,
    Paths,
    Robot,
    Temperature,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.terminal.console import Console

_FLANGE = "tool0"
_LISTED = 20


@dataclass(frozen=True)
class Filter:
    """Correct a robot program: its targets become those that bring the real robot where the nominal one would go.

    PROGRAM is URScript (Universal Robots), RAPID (ABB), KRL (KUKA) or TP (Fanuc), by its suffix. Targets written as numbers are
    corrected, in motions and in variables that are set once; all other text stays as it is, byte for byte. Targets that the controller
    computes when the program runs stay and are listed.

    Poses count in the frame base of the URDF, and the controller's kinematics as those of the URDF. A program of several files goes
    into the folder --out, under the names of its files.
    """

    robot: Robot
    program: Annotated[
        Positional[Paths],
        file_argument("PROGRAM...", "the program (.script, .mod, .src, .ls), and further files of it"),
    ] = ()
    place: Annotated[
        MaybePath,
        arg(
            name="out",
            aliases=["-o"],
            metavar="FILE",
            help_behavior_hint="(default: corrected, with the suffix of PROGRAM)",
        ),
    ] = None
    """File for the new program; the folder for one of several files, which keep their names."""
    temperature: Temperature = None
    estimates: Estimates = None
    tool: Annotated[Numbers, arg(metavar="X...", help_behavior_hint="(default: that of the program)")] = ()
    """Tool centre point in the flange for poses before which the program sets none, in the program's own numbers and units."""
    start: Annotated[
        Numbers,
        arg(metavar="Q...", help_behavior_hint="(default: the target before, or what the program says)"),
    ] = ()
    """Joint positions, in the program's units, that have the configuration of the arm at poses before which there are none."""
    joint_signs: Annotated[Numbers, arg(metavar="S...", help_behavior_hint="(default: 1 1 1 1 1 1)")] = ()
    """Signs of the joints where the URDF counts them otherwise than the controller: URDF = sign * controller + zero."""
    joint_zeros: Annotated[Numbers, arg(metavar="Q...", help_behavior_hint="(default: 0 0 0 0 0 0)")] = ()
    """Joint positions of the URDF at those of the controller that are zero, in the program's units."""
    flange: Annotated[str, arg(metavar="FRAME")] = _FLANGE
    """URDF frame of the flange, in which tools are given."""
    reverse: Annotated[bool, arg(help_behavior_hint="")] = False
    """Return from a corrected program to the original one."""
    subdivide: Annotated[
        MaybeNumber,
        arg(metavar="MM", help_behavior_hint="(default: no points are inserted)"),
    ] = None
    """Insert points into straight motions whose correction misses the needed one by more than this between their ends."""
    report: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="(default: none)")] = None
    """Page (.html) with every target and the path in space."""
    dry_run: Annotated[bool, arg(help_behavior_hint="")] = False
    """List all targets, nominal and corrected, and write no program."""
    json: Json = False

    @property
    def out(self) -> Path | None:
        """File or folder that is written: none by a dry run."""
        return None if self.dry_run else self._destination

    @property
    def _destination(self) -> Path:
        """File or folder of the new program."""
        suffix = self._sources[0].suffix if len(self._sources) == 1 else ""
        return self.place or Path("corrected" + suffix)

    @property
    def leaves(self) -> tuple[str, ...]:
        """Patterns of the files that a program of several leaves in the folder; none for one file."""
        names = [glob.escape(file.name) for file in self._sources]
        return tuple(names) if len(names) > 1 else ()

    @cached_property
    def _sources(self) -> list[Path]:
        """Files that the new program has too; as given where some are missing, which `run` refuses."""
        from flexcal.jobs.deployment import written_files

        there = all(file.is_file() for file in self.program)
        return written_files(self.program) if there and self.program else list(self.program)

    def _place_of(self, item: dict[str, Any]) -> str:
        """Line of a target, with its file where the program has several."""
        line = f"line {item['line']}"
        return f"{Path(item['file']).name}, {line}" if self.leaves else line

    def run(self) -> None:
        """Correct the program, and print each target and what stays as it is."""
        from flexcal.jobs.deployment import filter_program_file
        from flexcal.units import MILLIMETRE

        require_robot_and_files(self.robot, self.program, "program")
        out = self._destination
        console = Console(self.json)
        result = filter_program_file(
            self.robot,
            self.program,
            self.out,
            estimates=self.estimates,
            tool=self.tool,
            start=self.start,
            signs=self.joint_signs,
            zeros=self.joint_zeros,
            flange=self.flange,
            reverse=self.reverse,
            subdivide=None if self.subdivide is None else self.subdivide * MILLIMETRE,
            temperature=self.temperature,
            page=self.report,
            command=command_line(),
        )
        document = result.document()
        rows = document["targets"]
        console.say(result.headline)
        listed = rows if self.dry_run else rows[:_LISTED]
        for item in listed:
            console.say(
                f"{self._place_of(item)}: {item['motion']} {item['name']}: [{_numbers(item['before'])}] → [{_numbers(item['after'])}], "
                f"moved by {item['shift_mm']:.3f} mm and {item['turn_deg']:.3f}°"
            )
        if len(rows) > len(listed):
            console.say(f"{len(rows) - len(listed)} more with --dry-run, and under targets in --json")
        for item in document["left"]:
            console.say(f"left as it is: {self._place_of(item)}: {item['text']}: {item['reason']}")
        for remark in document["remarks"]:
            console.say(remark)
        if self.report is not None:
            console.say(f"wrote {self.report}")
        if self.dry_run:
            command = self._command(self.program, self.reverse, str(out), self._further)
            console.finish(
                document, f"{command} writes it" if rows else "see above why no target is corrected"
            )
            return
        console.say(f"wrote {out}")
        tables = [file for file in self.program if file not in self._sources]
        files = [out / file.name for file in self._sources] if self.leaves else [out]
        if self.reverse:
            console.finish(document, f"compare {out} with the original program")
            return
        back = "ORIGINAL" if self.leaves else f"ORIGINAL{out.suffix}"
        command = self._command([*files, *tables], True, back)
        console.finish(document, f"run {out} slowly first; the way back: {command}")

    def _command(self, files: Sequence[Path], reverse: bool, out: str, further: Sequence[str] = ()) -> str:
        """Command line for these files with the options of this one that say how programs are read."""
        words = ["flexcal", "filter", str(self.robot), *map(str, files)]
        for option, values in (
            ("--tool", self.tool),
            ("--start", self.start),
            ("--joint-signs", self.joint_signs),
            ("--joint-zeros", self.joint_zeros),
        ):
            words += [option, *(f"{value:.15g}" for value in values)] if values else []
        words += ["--flange", self.flange] if self.flange != _FLANGE else []
        words += ["--reverse"] if reverse else []
        words += [*further, "--out", out]
        words += [] if self.estimates is None else ["--estimates", str(self.estimates)]
        return shlex.join(words)

    @property
    def _further(self) -> list[str]:
        return [] if self.subdivide is None else ["--subdivide", f"{self.subdivide:g}"]


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{value:.6f}".rstrip("0").rstrip(".") for value in values)
