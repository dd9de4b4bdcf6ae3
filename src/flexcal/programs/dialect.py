"""A dialect of robot programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flexcal.programs.arm_at_zero import ArmAtZero
from flexcal.programs.configuration import Configuration
from flexcal.programs.notation import Notation
from flexcal.programs.program import Program, ProgramFile


@dataclass(frozen=True)
class Dialect:
    """A dialect of robot programs.

    Attributes
    ----------
    name : str
        Its name, and who makes the robots.
    suffixes : tuple of str
        Suffixes of its files, in lower case.
    notation : Notation
        How it writes poses and joint positions; `--tool` and `--start` are given so too.
    parse : callable
        Function from the files of a program to its targets. Raises `InputError` where a file cannot be read.
    beside : tuple of str
        Suffixes of files of the same name, beside a file of the program, that belong to it.
    tables : tuple of str
        Those of `suffixes` whose files are only read: frames and tools of the controller.
    configuration : Configuration or None
        Its configuration data.
    zero : ArmAtZero or None
        How arms of its maker stand at joint positions zero; None where arms differ, and joint positions count as those of the URDF.
    level_forearm : bool
        Whether joint 3 is counted from the horizontal, so that it turns against the lower arm by the sum of joints 2 and 3.
    no_start : str
        What a program can give so that the configuration of the arm at its first pose is known, beside `--start`.
    """

    name: str
    suffixes: tuple[str, ...]
    notation: Notation
    parse: Callable[[Sequence[ProgramFile]], Program]
    beside: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    configuration: Configuration | None = None
    zero: ArmAtZero | None = None
    level_forearm: bool = False
    no_start: str = "no joint positions stand before it"
