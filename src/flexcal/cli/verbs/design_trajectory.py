"""`flexcal design trajectory`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Json,
    MaybeNumber,
    MaybePath,
    Numbers,
    Robot,
    Seed,
    Texts,
    require_robot,
)
from flexcal.cli.arguments.suggested_commands import measure_command
from flexcal.cli.terminal.console import Console


@dataclass(frozen=True)
class DesignTrajectory:
    """Plan exciting trajectories: periodic motions within all limits and without collision that best determine the robot's dynamics.

    Beside the plan, every trajectory is written as timed joint positions from rest to rest, as CSV and as a ROS JointTrajectory: move the
    robot slowly to the first position, and log it at a fixed rate from before the motion until after it.
    """

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")] = Path("trajectory.yaml")
    """File for the plan."""
    count: Annotated[int, arg(metavar="N"), Between(1, 99)] = 3
    """Number of trajectories; each is optimised given the previous ones."""
    criterion: Literal["compound", "posterior", "condition", "D", "E", "A", "c"] = "compound"
    """compound: posterior and condition together.
    posterior: masses, centres of mass and rotors, with robot.yaml's prior; c: variances of the parameters --of, with it.
    Of the base parameters without prior: condition number of the column-scaled observation matrix, log det (D), least eigenvalue of the
    information (E), trace of the covariance (A)."""
    of: Annotated[Texts, arg(metavar="NAME...", help_behavior_hint="")] = ()
    """Parameters of the criterion c, such as link_3.mass or payload.mass."""
    sequence: Annotated[
        Literal["links", "axes", "kinds"] | None,
        arg(metavar="{links,axes,kinds}", help_behavior_hint="(default: none)"),
    ] = None
    """One trajectory for each link from the last on, for wrist and main axes, or for inertia, gravity and friction; with --criterion D."""
    after: Annotated[MaybePath, arg(metavar="PLAN", help_behavior_hint="")] = None
    """A plan that is already recorded; its information is added."""
    kind: Literal["fourier", "spline"] = "fourier"
    """Fourier series, or cyclic B-splines with three control points for each of the harmonics."""
    duration: Annotated[float, arg(metavar="S"), Between(0.01, 3600)] = 10.0
    """Duration of a trajectory in seconds, without one period to settle."""
    base_frequency: Annotated[float, arg(metavar="HZ"), Between(0.001, 100)] = 0.2
    """Base frequency of the trajectories."""
    harmonics: Annotated[int, arg(metavar="N"), Between(1, 100)] = 5
    """Number of multiples of the base frequency."""
    rest: bool = False
    """Every period begins and ends at rest."""
    start: Annotated[Numbers, arg(metavar="Q", help_behavior_hint="(default: optimised)")] = ()
    """Joint positions, rad or m, where every period begins and ends at rest."""
    share: Annotated[float, arg(metavar="SHARE")] = 0.8
    """Fraction of the limits of velocities, accelerations and torques that a motion may use; the controller needs the rest."""
    loaded: bool = False
    """With the declared payload, as for a criterion of its parameters; without by default."""
    searches: Annotated[int, arg(metavar="N"), Between(1, 1000)] = 3
    """Number of searches, each from a random start, of which the best is kept."""
    steps: Annotated[int, arg(metavar="N"), Between(1, 10_000)] = 20
    """Iterations at each level of the barrier; 40 nearly converge."""
    rate: Annotated[
        MaybeNumber,
        arg(metavar="HZ", help_behavior_hint="(default: 100, more for fast motions)"),
        Between(1, 20_000),
    ] = None
    """Timed joint positions a second; the cycle of a controller that takes one position each."""
    ros: Literal["yaml", "mcap"] = "yaml"
    """The ROS JointTrajectory as YAML for ros2 topic pub, or in MCAP files for ros2 bag play."""
    seed: Seed = 0
    """Seed of the random starts."""
    json: Json = False

    def run(self) -> None:
        """Plan, and print how long it takes."""
        from flexcal.jobs.experiments import TrajectoryRequest, plan_trajectories

        require_robot(self.robot)
        console = Console(self.json)
        request = TrajectoryRequest(
            count=self.count,
            criterion=self.criterion,
            of=self.of,
            sequence=self.sequence,
            kind=self.kind,
            duration=self.duration,
            base_frequency_hz=self.base_frequency,
            harmonics=self.harmonics,
            rest=self.rest,
            start=self.start,
            share=self.share,
            loaded=self.loaded,
            searches=self.searches,
            steps=self.steps,
            seed=self.seed,
        )
        with console.progress() as progress:
            document = plan_trajectories(
                self.robot,
                self.out,
                request,
                after=self.after,
                rate_hz=self.rate,
                ros=self.ros,
                command=command_line(),
                progress=progress,
            ).document()
        without = "" if document["payload"] is None else ", without the payload"
        one = document["trajectories"] == 1
        console.say(
            f"wrote {self.out}: {document['trajectories']} {'trajectory' if one else 'trajectories'} of {document['periods']} periods of "
            f"{1 / document['base_frequency_hz']:g} s{without}, {document['seconds_on_the_robot']:.0f} s on a real robot"
        )
        console.say(
            f"{document['base_parameters']} base parameters, condition number {document['condition']:.3g} of the column-scaled observation "
            f"matrix; criterion {self.criterion}: "
            + ", ".join(f"{merit:.4g}" for merit in document["merits"])
        )
        first = document["timed"][0]
        runs_up = f" (the first {first['run_up_s']:g} s run up to speed)" if first["run_up_s"] else ""
        csv, ros = ([str(file[kind]) for file in document["timed"]] for kind in ("csv", "ros"))
        console.say(
            f"wrote {' '.join(csv)}: timed joint positions at {first['rate_hz']:g} Hz, from rest to rest{runs_up}; and {' '.join(ros)}, "
            "the same as ROS JointTrajectory"
        )
        for remark in document["remarks"]:
            console.say(remark)
        console.say(f"wrote {document['page']}, with figures")
        folder = "loaded" if self.loaded else "exciting"
        virtual = measure_command(self.out, self.robot, folder)
        real = virtual.replace("--cell virtual", "--cell FOLDER")
        console.finish(document, f"{virtual}; or record it on the robot, and {real}")
