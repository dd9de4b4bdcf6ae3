"""`flexcal design poses`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Json,
    MaybeNumber,
    MaybePath,
    MaybeText,
    On,
    Paths,
    Payload,
    Processes,
    Robot,
    Seed,
    require_robot,
)
from flexcal.cli.arguments.suggested_commands import import_command, measure_command
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted
from flexcal.units import MILLIMETRE

Planned = TypeVar("Planned")
_APPROACHED = (
    ", approached from both sides by way of points 2° before them (approach1… and via1… of a plan in CSV)"
)
_UNSEEN = 0.1
"""Share of the error from noise above which an error that no reading tells is said."""


@dataclass(frozen=True)
class DesignPoses:
    """Choose the calibration poses with the smallest predicted tool error in the working volume, within joint limits, free of collision and
    visible to the instrument, and order them for short moves. A page with figures is written beside the plan.

    With --from, poses are chosen from a file; with --measured, the next ones after those measured; --random draws random poses of the
    workspace instead, for a verification.
    """

    robot: Robot
    count: Annotated[int, arg(metavar="N"), Between(1, 10_000)] = 40
    """Number of poses; with --wanted, --measured or --prior the maximum."""
    out: Annotated[Path, arg(metavar="FILE")] = Path("poses.yaml")
    """File for the plan, YAML or CSV."""
    working: Annotated[
        MaybeText,
        arg(metavar="BOX|FILE", help_behavior_hint="(default: as robot.yaml declares, else anywhere)"),
    ] = None
    """Working volume: ranges of x, y, z in m like 0.4:0.9,-0.3:0.3,0.2:0.8, or a CSV of points x, y, z or of poses."""
    wanted: Annotated[
        MaybeNumber,
        arg(
            metavar="MM",
            help_behavior_hint="(default: --count poses; with --measured until more poses only average noise)",
        ),
    ] = None
    """Stop when the predicted tool error is at most this, mm."""
    measured: Annotated[Paths, arg(metavar="FILE...", help_behavior_hint="(default: none)")] = ()
    """Measured poses, to choose the next ones, best first."""
    pool: Annotated[
        MaybePath, arg(name="from", metavar="FILE", help_behavior_hint="(default: random poses)")
    ] = None
    """Candidate poses, CSV or Parquet with pose, q1, q2 and so on: poses taught on the robot, or measured before."""
    random: bool = False
    """Random poses, for a verification; of the other options only count, payload and seed apply."""
    criterion: Literal["c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"] = "c"
    """c: smallest predicted tool error; A, D, E: criteria of the parameter covariance; O1-O5: observability indices."""
    candidates: Annotated[int, arg(metavar="N"), Between(1, 100_000_000)] = 4000
    """Number of random candidate poses, without --from; of more than 50000 the best of every block are compared (a million: a minute)."""
    payload: Annotated[
        MaybeNumber, arg(metavar="KG", help_behavior_hint="(default: as robot.yaml declares)"), Payload
    ] = None
    """Payload in these poses, kg."""
    measure: Annotated[
        MaybeText, arg(metavar="NAME", help_behavior_hint="(default: a tracker of points)")
    ] = None
    """What will measure: a name under measurements: of robot.yaml that says where it stands, or pose for a tracker of orientations too."""
    prior: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="(default: typical tolerances)")] = (
        None
    )
    """Prior from other robots, as 'flexcal fleet --prior' writes it, for 'calibrate --prior': poses that tell what it does not, as
    many as reach what 40 random ones do without it."""
    seed: Seed = 0
    """Seed of the random poses."""
    jobs: Processes = 1
    on: On = None
    json: Json = False

    def run(self) -> None:
        """Choose the poses, and print the predicted tool error."""
        require_robot(self.robot)
        if self.wanted is not None and not self.wanted > 0:
            raise InputError("E-CLI-022", f"--wanted is {self.wanted:g}; it must be a positive number of mm.")
        if self.random and self.pool is not None:
            raise InputError("E-CLI-023", "--random and --from exclude each other; give one of them.")
        if self.measure is not None and (self.random or self.measured or self.pool is not None):
            raise InputError("E-CLI-042", "--measure goes with none of --random, --measured and --from.")
        if self.prior is not None and (self.random or self.measured or self.measure is not None):
            raise InputError("E-CLI-048", "--prior goes with none of --random, --measured and --measure.")
        if (self.on is not None or self.jobs > 1) and (self.random or self.measured or self.pool is not None):
            raise InputError(
                "E-CLI-046",
                "--on and --jobs share out random candidates, and go with none of --random, --measured and --from.",
            )
        if self.random and self.measured:
            raise InputError("E-CLI-024", "--random and --measured exclude each other; give one of them.")
        console = Console(self.json)
        if self.random:
            self._draw(console)
        elif self.measured:
            self._continue(console)
        else:
            self._choose(console)

    def _draw(self, console: Console) -> None:
        from flexcal.jobs.experiments import plan_verification_poses

        drawn = plan_verification_poses(
            self.robot,
            self.out,
            self.count,
            payload=self.payload,
            seed=self.seed,
            command=command_line(),
        )
        console.say(f"wrote {self.out}: {self.count} random poses{_APPROACHED}")
        console.finish(
            drawn.document(),
            f"{measure_command(self.out, self.robot, 'unseen')}{import_command(self.robot, 'unseen.csv')}",
        )

    def _planned(self, console: Console, plan: Callable[..., Planned]) -> Planned:
        from flexcal.jobs.experiments import PoseRequest, PoseRequestFiles

        request = PoseRequest(
            self.count,
            criterion=self.criterion,
            candidates=self.candidates,
            desired_error=None if self.wanted is None else self.wanted * MILLIMETRE,
            payload=self.payload,
            seed=self.seed,
            measure=self.measure,
        )
        files = PoseRequestFiles(self.pool, self.working, self.prior)
        with console.progress() as progress:
            return plan(self.robot, self.out, request, files, command=command_line(), progress=progress)

    def _choose(self, console: Console) -> None:
        from flexcal.jobs.experiments import plan_calibration_poses

        design = self._planned(console, partial(plan_calibration_poses, on=self.on, jobs=self.jobs))
        document = design.document()
        seen = document["identifiability"]
        prior = document["prior"]
        if prior is None:
            what = (
                "position measurements"
                if self.measure is None
                else f"the readings of {document['instrument']}"
            )
            console.say(f"{seen['rank']} of {seen['parameters']} parameters are identifiable from {what}")
        else:
            console.say(
                f"{prior['parameters']} parameters have a prior from {len(prior['robots'])} other robots ({prior['file']}); the place of "
                "the instrument and of the target, nine numbers, are this robot's own"
            )
        console.say(
            f"predicted tool error from the noise of {document['instrument']} alone: {document['tool_error_mm']:.4f} mm "
            f"(rms over {_where(document)}; 90 % below {document['tool_error_p90_mm']:.4f} mm); "
            f"lower bound for this number of poses: {document['least_possible_mm']:.4f} mm; {design.number_sentence}"
        )
        if self.measure is not None:
            unseen, tracked = document["unseen_mm"], document["with_tracker_mm"]
            if unseen > _UNSEEN * document["tool_error_mm"]:
                console.say(
                    f"besides, {unseen:.3f} mm are what these readings cannot tell, from typical tolerances and the stated accuracy of "
                    "board, wire or sockets"
                )
            console.say(f"how large the robot is: {document['size']['sentence']}")
            console.say(f"with a tracker of points and as many poses: {tracked:.4f} mm")
            console.say(zeros_line(document["zeros"], document["instrument"]))
        others = {name: value for name, value in document["criteria"].items() if name != "c"}
        console.say("criteria: " + ", ".join(f"{name} {value:.4g}" for name, value in others.items()))
        self._say_pool(console, document)
        blocked = document["blocked_moves"]
        ways = ", ".join(f"{a} to {b}" for a, b in blocked)
        console.say(
            f"the moves between them take {document['moves_s']:.1f} s or more"
            + (f"; the straight joint motion from {ways} collides: add via points" if blocked else "")
        )
        console.say(f"wrote {self.out}: {document['poses']} poses{_APPROACHED}")
        then = "" if prior is None else f"; then flexcal calibrate with --prior {quoted(prior['file'])}"
        console.finish(
            document,
            f"{measure_command(self.out, self.robot, 'measured')}{import_command(self.robot, 'measured.csv')}{then}",
        )

    def _continue(self, console: Console) -> None:
        from flexcal.jobs.experiments import plan_next_poses

        design = self._planned(console, partial(plan_next_poses, measured=self.measured))
        document = design.document()
        errors, least = document["tool_error_mm"], document["least_possible_mm"]
        console.say(
            f"after {document['measured']} measured poses the predicted tool error is {errors[0]:.4f} mm from tracker noise alone "
            f"(rms over {_where(document)}); lower bound for this number of poses: {least[0]:.4f} mm"
        )
        stop = document["stop_after"]
        aim = (
            "further poses only average noise" if self.wanted is None else f"it is at most {self.wanted:g} mm"
        )
        if stop == 0:
            console.say(f"stop here: {aim}; no plan was written")
            console.finish(document, "flexcal calibrate with the measured poses")
            return
        self._say_pool(console, document)
        reached = errors[document["poses"]]
        console.say(
            f"after {document['poses']} more it is {reached:.4f} mm"
            + (f": then stop, {aim}" if stop is not None else "; more poses are needed")
        )
        console.say(f"wrote {self.out}: the next {document['poses']} poses, best first{_APPROACHED}")
        console.finish(
            document,
            f"{measure_command(self.out, self.robot, 'more')}{import_command(self.robot, 'more.csv')}",
        )

    def _say_pool(self, console: Console, document: Mapping[str, Any]) -> None:
        if self.pool is not None:
            if "drawn" in document:
                drawn = document["drawn"]
                console.say(
                    f"of {drawn['among']} poses {drawn['considered']}, drawn at random, were considered"
                )
            console.say(f"chosen from {self.pool}: {', '.join(map(str, document['chosen']))}")
            unsure, hidden = len(document["flank_not_sure"]), len(document["not_seen"])
            if unsure:
                console.say(
                    f"{unsure} poses were left out because the flank of a backlash is uncertain there"
                )
            if hidden:
                console.say(f"{hidden} poses were left out because the instrument does not see them")
        for joint, sides in document["flanks"].items():
            console.say(
                f"{joint}: {sides['positive']} poses on one flank of its backlash, {sides['negative']} on the other"
            )


def zeros_line(zeros: Mapping[str, Mapping[str, float]], instrument: str) -> str:
    """A sentence on the predicted accuracy of joint zeros; `zeros` as in the document."""
    from flexcal.design.poses import UNKNOWN_ZERO

    told = [
        f"{joint} {zero['std'] / MILLIMETRE:.3f} ({zero['with_tracker'] / MILLIMETRE:.3f})"
        for joint, zero in zeros.items()
        if zero["std"] < UNKNOWN_ZERO / 2
    ]
    lost = [joint for joint, zero in zeros.items() if zero["std"] >= UNKNOWN_ZERO / 2]
    where = f"; {instrument} does not tell {', '.join(lost)}, or not apart from others" if lost else ""
    if not told:
        return f"{instrument} tells no joint zero of its own"
    return f"joint zeros will be known to ± mrad (with the tracker): {', '.join(told)}{where}"


def _where(document: Mapping[str, Any]) -> str:
    working = document["working"]
    if working is None:
        return "the workspace"
    share = working["reached_share"]
    return "the working volume" + (f", {100 * share:.0f} % of it within reach" if share < 1 else "")
