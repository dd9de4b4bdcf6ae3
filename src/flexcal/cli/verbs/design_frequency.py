"""`flexcal design frequency`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Json,
    MaybeCount,
    MaybeNumber,
    MaybePath,
    Robot,
    Seed,
    require_robot,
)
from flexcal.cli.arguments.suggested_commands import export_command, measure_command
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError


@dataclass(frozen=True)
class DesignFrequency:
    """Plan the frequency experiments: odd random-phase multisines on every elastic axis, under a slow reference motion.

    The standard deviation of every stiffness and damping is predicted from the present robot model, before any measurement.
    """

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")] = Path("frequency.yaml")
    """File for the plan."""
    plan: Literal["default", "paper", "designed", "quick"] = "default"
    """default: payload as declared, 1.5° of reference motion; paper: no payload, 3°; designed: as default, with poses and amplitudes
    optimised for the springs; quick: the same in half the time."""
    poses: Annotated[
        MaybePath,
        arg(metavar="FILE", help_behavior_hint="(default: frequency_poses.csv beside robot.yaml)"),
    ] = None
    """Poses of the experiments: CSV with plan, pose, q1_deg, q2_deg and so on."""
    choose: Annotated[MaybeCount, arg(metavar="N", help_behavior_hint="(default: 6)"), Between(1, 1000)] = (
        None
    )
    """Number of poses for designed and quick."""
    candidates: Annotated[int, arg(metavar="N"), Between(1, 100_000)] = 300
    """Number of random candidate poses for designed and quick."""
    amplitude: Annotated[
        Literal["flat", "shaped"] | None,
        arg(
            metavar="{flat,shaped}", help_behavior_hint="(default: shaped for designed and quick, else flat)"
        ),
    ] = None
    """The same torque on every line, or more where the response depends on the springs."""
    std: Annotated[MaybeNumber, arg(metavar="SHARE", help_behavior_hint="(default: as the plan has it)")] = (
        None
    )
    """Required relative standard deviation of every stiffness, 0.01 for 1 %; determines realisations and periods."""
    crest: Literal["random", "optimised"] = "random"
    """Random phases, or phases optimised for a small crest factor of the torque."""
    detection_lines: bool = False
    """Leave one line in four unexcited, to measure odd nonlinear distortion there."""
    place_payload: bool = False
    """Also predict the standard deviations for the payload at other angles about the last axis, at the same distance from it."""
    seed: Seed = 0
    """Seed of the random phases."""
    json: Json = False

    def run(self) -> None:
        """Plan, and print how long it takes."""
        from flexcal.cli.tables.results import predicted_table
        from flexcal.jobs.experiments import FrequencyRequest, plan_frequency_experiments

        require_robot(self.robot)
        if self.std is not None and not self.std > 0:
            raise InputError(
                "E-CLI-020", f"--std is {self.std:g}; it must be positive, such as 0.01 for 1 %."
            )
        if self.choose is not None and (self.poses is not None or self.plan in ("default", "paper")):
            raise InputError(
                "E-CLI-021",
                "--choose is for --plan designed or quick without --poses; the others take the poses of a file.",
            )
        console = Console(self.json)
        request = FrequencyRequest(
            kind=self.plan,
            candidates=self.candidates,
            amplitude=self.amplitude,
            desired_std=self.std,
            crest=self.crest,
            detection_lines=self.detection_lines,
            place_payload=self.place_payload,
            seed=self.seed,
        )
        if self.choose is not None:
            request = replace(request, choose=self.choose)
        with console.progress() as progress:
            document = plan_frequency_experiments(
                self.robot,
                self.out,
                request,
                poses=self.poses,
                command=command_line(),
                progress=progress,
            ).document()
        console.show(predicted_table(document["predicted_std"]))
        if document["sensors"]:
            console.say(
                f"this counts on the sensors on the arm that robot.yaml declares ({', '.join(document['sensors'])}): record their "
                "readings in the columns sensor_NAME"
            )
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
        console.finish(
            document,
            f"{measure_command(self.out, self.robot, 'frequency')}; or on the robot: {export_command(self.out, self.robot)}",
        )
