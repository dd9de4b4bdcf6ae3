"""Targets of a program as a dialect's reader finds them, motion by motion."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

from flexcal.programs.dialect import Dialect
from flexcal.programs.pose import Pose
from flexcal.programs.program import Program, ProgramFile, ProgramTarget, RunTimeTarget

RUN_TIME = "the controller computes it when the program runs"
"""Why a target is not corrected whose numbers are not in the program."""


@dataclass
class TargetList:
    """Targets in the order of their first use; one whose uses need different numbers is none that can be corrected."""

    targets: dict[tuple[int, int], ProgramTarget] = field(default_factory=dict)
    doubtful: dict[tuple[int, int], str] = field(default_factory=dict)
    computed: list[RunTimeTarget] = field(default_factory=list)

    def add(self, target: ProgramTarget) -> None:
        """Note a motion to a target whose numbers are written."""
        place = (target.file, target.numbers[0].first)
        earlier = self.targets.setdefault(place, target)
        if _differ(earlier.tool, target.tool) or earlier.payload != target.payload:
            self.doubtful[place] = (
                "it is reached with different tools or payloads, each of which needs other numbers"
            )
        elif _differ(earlier.frame, target.frame):
            self.doubtful[place] = "it is reached in different frames, each of which needs other numbers"

    def leave(self, line: int, text: str, reason: str, file: int = 0) -> None:
        """Note a motion to a target that stays as it is."""
        item = RunTimeTarget(line, " ".join(text.split()), reason, file)
        if item not in self.computed:
            self.computed.append(item)

    def program(
        self,
        dialect: Dialect,
        files: Sequence[ProgramFile],
        variables: Collection[str],
        remarks: Sequence[str],
    ) -> Program:
        """The program; of a target that is computed from corrected ones of the `variables` the reason names these."""
        kept = [target for place, target in self.targets.items() if place not in self.doubtful]
        corrected = {target.name.split("{")[0].lower() for target in kept} & {
            name.lower() for name in variables
        }
        left = [
            RunTimeTarget(
                self.targets[place].line, self.targets[place].name, reason, self.targets[place].file
            )
            for place, reason in self.doubtful.items()
        ]
        left += [_built_from(item, corrected) for item in self.computed]
        ordered = sorted(left, key=lambda item: (item.file, item.line))
        return Program(dialect, tuple(files), tuple(kept), tuple(ordered), tuple(remarks))


def _differ(one: Pose | None, other: Pose | None) -> bool:
    if one is None or other is None:
        return one is not other
    return not one.equals(other)


def _built_from(item: RunTimeTarget, corrected: set[str]) -> RunTimeTarget:
    """The same target, with the corrected variables that it is computed from."""
    names = [name for name in dict.fromkeys(re.findall(r"\w+", item.text)) if name.lower() in corrected]
    return replace(item, reason=f"{item.reason}, from {' and '.join(names)} as corrected") if names else item
