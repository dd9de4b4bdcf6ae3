"""`flexcal design frequency`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.command_line import command_line
from flexcal.cli.console import Console
from flexcal.cli.next_step import measuring
from flexcal.cli.options import Json, Robot, require_at_least, require_robot
from flexcal.errors import InputError


@dataclass(frozen=True)
class DesignFrequency:
    """Plan the frequency experiments: odd random-phase multisines on every elastic axis, under a slow reference motion.

    What they will tell of every spring is predicted from the robot as it is known; nothing needs to be measured for that.
    """

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")] = Path("frequency.yaml")
    """File for the plan."""
    plan: Literal["default", "paper", "designed", "quick"] = "default"
    """default: payload as declared, 1.5° of reference motion; paper: no payload, 3°; designed: as default, but poses and amplitudes are
    chosen for what they tell of the springs; quick: the same in half the time."""
    poses: Annotated[
        Path | None,
        arg(metavar="FILE", help_behavior_hint="(default: frequency_poses.csv beside robot.yaml)"),
    ] = None
    """Where to excite: CSV with plan, pose, q1_deg, q2_deg and so on."""
    choose: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 6)")] = None
    """Number of poses that designed and quick choose."""
    candidates: Annotated[int, arg(metavar="N")] = 300
    """Random poses that they choose from."""
    amplitude: Annotated[
        Literal["flat", "shaped"] | None,
        arg(
            metavar="{flat,shaped}", help_behavior_hint="(default: shaped for designed and quick, else flat)"
        ),
    ] = None
    """The same torque on every line, or more where the response depends on the springs."""
    std: Annotated[float | None, arg(metavar="SHARE", help_behavior_hint="(default: as the plan has it)")] = (
        None
    )
    """Measure until every stiffness has this relative standard deviation, 0.01 for 1 %: realisations and periods follow."""
    crest: Literal["random", "optimised"] = "random"
    """Phases as drawn, or shifted from there so that the torque's peaks are small."""
    detection_lines: bool = False
    """Leave out one line in four; what is seen there is the robot's odd nonlinear distortion."""
    place_payload: bool = False
    """Predict what holding the payload elsewhere about the last axis, as far off it, would change in these poses."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of the random phases."""
    json: Json = False

    def run(self) -> None:
        """Plan, and print how long it takes."""
        from flexcal.cli.tables import predicted_table
        from flexcal.workflow.design_frequency import plan_frequency_experiments

        require_robot(self.robot)
        require_at_least(0, seed=self.seed)
        require_at_least(1, choose=self.choose, candidates=self.candidates)
        if self.std is not None and not self.std > 0:
            raise InputError(f"--std is {self.std:g}; it must be positive, such as 0.01 for 1 %.")
        if self.choose is not None and (self.poses is not None or self.plan in ("default", "paper")):
            raise InputError(
                "--choose is for --plan designed or quick without --poses; the others take the poses of a file."
            )
        console = Console(self.json)
        with console.progress() as progress:
            document = plan_frequency_experiments(
                self.robot,
                self.out,
                kind=self.plan,
                poses=self.poses,
                choose=self.choose,
                candidates=self.candidates,
                amplitude=self.amplitude,
                wanted=self.std,
                crest=self.crest,
                detection_lines=self.detection_lines,
                place_payload=self.place_payload,
                seed=self.seed,
                command=command_line(),
                progress=progress,
            ).document()
        console.show(predicted_table(document["predicted_std"]))
        places = document.get("payload_placements", ())
        if places:
            best = min(places, key=lambda place: place["largest_std"])
            console.say(
                f"payload: as declared, the largest standard deviation of a stiffness is {100 * places[0]['largest_std']:.2f} %; with its "
                f"centre of mass at [{', '.join(f'{x:.3f}' for x in best['com'])}] it would be {100 * best['largest_std']:.2f} %"
            )
        console.say(
            f"wrote {self.out} and {document['page']}: {document['poses']} poses, {document['lines']} lines from "
            f"{document['lowest_hz']:g} to {document['highest_hz']:g} Hz, {document['recordings']} recordings, "
            f"{document['seconds_on_the_robot'] / 60:.0f} minutes on a real robot"
        )
        console.finish(document, f"{measuring(self.out, self.robot, 'frequency')}, or record it on the robot")
