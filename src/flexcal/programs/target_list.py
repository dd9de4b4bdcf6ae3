"""Targets of a program as a dialect's reader finds them, motion by motion."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from flexcal.programs.dialect import Dialect
from flexcal.programs.pose import Pose
from flexcal.programs.program import Divisible, Move, Program, ProgramFile, ProgramTarget, RunTimeTarget

RUN_TIME = "the controller computes it when the program runs"
"""Why a target is not corrected whose numbers are not in the program."""
_HEAVIEST = 1e4
"""Mass, kg, beyond any that an arm of six joints carries."""


@dataclass
class TargetList:
    """Targets in the order of their first use; one whose uses need different numbers is none that can be corrected."""

    targets: dict[tuple[int, int], ProgramTarget] = field(default_factory=dict)
    doubtful: dict[tuple[int, int], str] = field(default_factory=dict)
    computed: list[RunTimeTarget] = field(default_factory=list)
    motions: list[_Motion] = field(default_factory=list)

    def begin(self, count: int, *, straight: bool, divisible: Divisible | None = None) -> None:
        """Begin a motion to `count` targets, which are added or left next; `divisible` as in `Move`."""
        self.motions.append(_Motion(count, straight, divisible))

    def interrupt(self) -> None:
        """Note that what follows does not start where the last motion ended."""
        self.motions.append(_Motion(1, False, None))

    def add(self, target: ProgramTarget) -> None:
        """Note a motion to a target whose numbers are written."""
        place = (target.file, target.numbers[0].first)
        if self.motions:
            self.motions[-1].goals.append(place)
        earlier = self.targets.setdefault(place, target)
        if _differ(earlier.tool, target.tool) or earlier.payload != target.payload:
            self.doubtful[place] = (
                "it is reached with different tools or payloads, each of which needs other numbers"
            )
        elif _differ(earlier.frame, target.frame):
            self.doubtful[place] = "it is reached in different frames, each of which needs other numbers"

    def leave(self, line: int, text: str, reason: str, file: int = 0) -> None:
        """Note a motion to a target that stays as it is."""
        if self.motions:
            self.motions[-1].goals.append(None)
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
        for place, target in self.targets.items():
            if fault := dialect.notation.fault(target.values, joints=target.joints):
                self.doubtful[place] = fault
            elif abs(target.payload or 0.0) > _HEAVIEST:
                self.doubtful[place] = f"its payload is more than {_HEAVIEST:g} kg: correct it"
        kept = [target for place, target in self.targets.items() if place not in self.doubtful]
        known = {name.lower() for name in variables}
        sources = {target.variable.lower() for target in kept} & known
        left = [
            RunTimeTarget(
                self.targets[place].line, self.targets[place].name, reason, self.targets[place].file
            )
            for place, reason in self.doubtful.items()
        ]
        left += [_built_from(item, sources) for item in self.computed]
        index = {
            place: k for k, place in enumerate(place for place in self.targets if place not in self.doubtful)
        }
        ordered = sorted(left, key=lambda item: (item.file, item.line))
        told = (*remarks, *self._guessed(index, kept))
        return Program(dialect, tuple(files), tuple(kept), tuple(ordered), told, self._moves(index))

    def _guessed(
        self, index: Mapping[tuple[int, int], int], targets: Sequence[ProgramTarget]
    ) -> tuple[str, ...]:
        """Remark on poses whose configuration is that of a target before, though the motion between goes elsewhere."""
        lines: dict[int, None] = {}
        lost = begun = False
        for motion in self.motions:
            goals = [None if place is None else index.get(place) for place in motion.goals]
            known = [targets[goal] for goal in goals if goal is not None]
            free = [each for each in known if not (each.joints or each.configuration or each.near)]
            if lost and begun:
                lines |= dict.fromkeys(target.line for target in free)
            begun = begun or bool(known)
            lost = bool(goals) and None in goals
        if not lines:
            return ()
        return (
            f"the motion before goes to a target that is not known, so the arm's configuration is taken to be that of the last known one: "
            f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines))}; check it there",
        )

    def _moves(self, index: Mapping[tuple[int, int], int]) -> tuple[Move, ...]:
        """Straight motions and arcs between targets of known indices."""
        moves: list[Move] = []
        last: int | None = None
        for motion in self.motions:
            goals = [None if place is None else index.get(place) for place in motion.goals]
            known = [goal for goal in goals if goal is not None]
            if len(known) != motion.count or len(goals) != motion.count:
                last = None
                continue
            if last is not None and motion.straight:
                via = known[0] if motion.count > 1 else None
                moves.append(Move(last, via, known[-1], motion.divisible))
            last = known[-1]
        return tuple(moves)


@dataclass
class _Motion:
    """A motion to `count` targets: their places, or None for one that stays as it is."""

    count: int
    straight: bool
    divisible: Divisible | None
    goals: list[tuple[int, int] | None] = field(default_factory=list)


def _differ(one: Pose | None, other: Pose | None) -> bool:
    if one is None or other is None:
        return one is not other
    return not one.equals(other)


def _built_from(item: RunTimeTarget, variables: Collection[str]) -> RunTimeTarget:
    """The same target, with those of the variables (lower case) that it is computed from, as it writes them."""
    words = dict.fromkeys(re.findall(r"\w+", item.text))
    return replace(item, sources=(*item.sources, *(word for word in words if word.lower() in variables)))
