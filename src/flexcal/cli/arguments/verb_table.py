"""The verbs in the order of the procedure, and the help page that lists them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from flexcal.errors import FlexcalError
from flexcal.export import FORMATS


@dataclass(frozen=True)
class Verb:
    """A verb: its words, the module and class that carry it out, what it does in a line, and a command line to copy.

    `leaves` are the files (glob patterns) that it leaves in the folder of --out; none where --out is the file itself, beside which it may
    leave a `page` of the same name, and files `beside` it: glob patterns of what follows its stem. The files of a verb that is
    `interactive` appear as it writes them, those of others all at its end.
    """

    words: tuple[str, ...]
    module: str
    command: str
    summary: str
    example: str
    leaves: tuple[str, ...] = ()
    page: bool = False
    beside: tuple[str, ...] = ()
    interactive: bool = False

    @property
    def name(self) -> str:
        return " ".join(self.words)


@dataclass(frozen=True)
class Step:
    """A step of the procedure and its verbs."""

    title: str
    verbs: tuple[Verb, ...]


EXPORTS = (
    *(
        Verb(
            ("export", format.name),
            "export",
            f"Export{format.name.capitalize()}",
            format.summary,
            f"flexcal export {format.name} robot.yaml --out {format.example}",
        )
        for format in FORMATS
    ),
    Verb(
        ("export", "xacro"),
        "export_xacro",
        "ExportXacro",
        "the xacro files or the URDF of the robot with calibrated numbers, every other byte as before",
        "flexcal export xacro robot.yaml --out description",
        leaves=("**",),
    ),
    Verb(
        ("export", "lerobot"),
        "export_lerobot",
        "ExportLerobot",
        "LeRobot's calibration of motors with the joint zeros, and whether zeros are enough or geometry is needed",
        "flexcal export lerobot robot.yaml --calibration motors.json --out corrected.json",
    ),
)

STEPS = (
    Step(
        "See the whole procedure on a virtual robot",
        (
            Verb(
                ("demo",),
                "demo",
                "Demo",
                "the whole procedure on a virtual robot with hidden true parameters, with a report",
                "flexcal demo --seed 1 --out demo",
                (
                    "truth.yaml",
                    "trajectory_plan.yaml",
                    "frequency_plan.yaml",
                    "response_pose_*.npz",
                    "fitted_responses.npz",
                    "calibration_poses.csv",
                    "verification_poses.csv",
                    "verification.csv",
                    "points.csv",
                    "arm.npz",
                    "estimates.yaml",
                    "estimates.npz",
                    "calibrated.urdf",
                    "results.json",
                    "report.html",
                ),
            ),
        ),
    ),
    Step(
        "Begin with a robot of your own",
        (
            Verb(
                ("init",),
                "init",
                "Init",
                "create a robot.yaml for a URDF, with comments on what to complete",
                "flexcal init robot.urdf",
            ),
            Verb(
                ("import",),
                "import_file",
                "Import",
                "convert measurements with other columns and units; prints how it read them",
                "flexcal import robot.yaml measured.csv --out poses.csv",
            ),
        ),
    ),
    Step(
        "Before that, where CAD does not know the masses well: inertias and friction, from recordings of exciting motion",
        (
            Verb(
                ("design", "trajectory"),
                "design_trajectory",
                "DesignTrajectory",
                "plan exciting trajectories of the whole robot",
                "flexcal design trajectory robot.yaml --out trajectory.yaml",
                page=True,
                beside=tuple(
                    number + kind
                    for number in ("_[1-9]", "_[1-9][0-9]")
                    for kind in (".csv", "_ros.yaml", "_ros.mcap")
                ),
            ),
            Verb(
                ("identify", "inertials"),
                "identify_inertials",
                "IdentifyInertials",
                "masses, centres of mass and friction from such recordings, with CAD as the prior",
                "flexcal identify inertials robot.yaml exciting",
                ("results.json", "report.html"),
            ),
            Verb(
                ("identify", "gains"),
                "identify_gains",
                "IdentifyGains",
                "drive gains from recordings with and without a payload",
                "flexcal identify gains robot.yaml logs/free.csv logs/loaded.csv",
                ("results.json", "report.html"),
            ),
            Verb(
                ("identify", "actuators"),
                "identify_actuators",
                "IdentifyActuators",
                "gains, delay, friction and armature of position-controlled joints, for simulators",
                "flexcal identify actuators robot.yaml moves.csv",
                ("results.json", "report.html"),
            ),
            Verb(
                ("identify", "dynamics"),
                "identify_dynamics",
                "IdentifyDynamics",
                "base parameters with intervals from joint logs",
                "flexcal identify dynamics robot.yaml exciting.parquet --hold-out last:0.3",
                ("results.json", "predictions.npz", "report.html", "learned_residual.npz"),
            ),
            Verb(
                ("identify", "payload"),
                "identify_payload",
                "IdentifyPayload",
                "mass, centre of mass and inertia of a payload from recordings with it",
                "flexcal identify payload robot.yaml loaded",
                ("results.json", "predictions.npz", "report.html"),
            ),
        ),
    ),
    Step(
        "1. Stiffness and damping, from frequency responses (not for a robot calibrated as rigid)",
        (
            Verb(
                ("design", "frequency"),
                "design_frequency",
                "DesignFrequency",
                "plan the frequency experiments",
                "flexcal design frequency robot.yaml --out frequency.yaml",
                page=True,
            ),
            Verb(
                ("export", "excitation"),
                "export_excitation",
                "ExportExcitation",
                "the signals of that plan as files that a robot's controller plays",
                "flexcal export excitation frequency.yaml --out excitation --rate 4000 --scale 0.8",
                ("plan.yaml", "manifest.csv", "moves.csv", "phases.csv", "move_*", "pose_*_realisation_*"),
            ),
            Verb(
                ("measure",),
                "measure",
                "Measure",
                "carry out a plan, in the virtual cell or from a folder of recorded files",
                "flexcal measure frequency.yaml --cell virtual --out frequency",
                ("plan.yaml", "pose_*_realisation_*", "poses.csv", "truth.yaml", "results.json"),
            ),
            Verb(
                ("identify", "response"),
                "identify_response",
                "IdentifyResponse",
                "frequency responses with their covariance from recordings, planned or not; resonances, and masses of an axis",
                "flexcal identify response robot.yaml frequency --out responses",
                (
                    "plan.yaml",
                    "response_pose_*.npz",
                    "response.npz",
                    "response.csv",
                    "results.json",
                    "report.html",
                ),
            ),
            Verb(
                ("identify", "stiffness"),
                "identify_stiffness",
                "IdentifyStiffness",
                "stiffness and damping from frequency responses",
                "flexcal identify stiffness robot.yaml responses",
                ("results.json", "fitted_responses.npz", "report.html"),
            ),
        ),
    ),
    Step(
        "2. Geometry, from measured tool positions",
        (
            Verb(
                ("design", "poses"),
                "design_poses",
                "DesignPoses",
                "choose the poses to measure",
                "flexcal design poses robot.yaml --count 40 --out poses.yaml",
                page=True,
            ),
            Verb(
                ("calibrate",),
                "calibrate",
                "Calibrate",
                "geometry from measured positions; lists the parameters that are not identifiable",
                "flexcal calibrate robot.yaml poses.csv",
                ("results.json", "points.csv", "arm.npz", "gravity_loads.npz", "tilts.csv", "report.html"),
            ),
        ),
    ),
    Step(
        "3. Check it, and use it",
        (
            Verb(
                ("identify", "tool"),
                "identify_tool",
                "IdentifyTool",
                "the tool centre point from touches of a fixed point",
                "flexcal identify tool robot.yaml touches.csv --frame tool0",
                ("results.json",),
            ),
            Verb(
                ("identify", "frame"),
                "identify_frame",
                "IdentifyFrame",
                "the frame of a work object from touches of its points or faces",
                "flexcal identify frame robot.yaml fixture.csv",
                ("results.json",),
            ),
            Verb(
                ("verify",),
                "verify",
                "Verify",
                "accuracy at poses outside the calibration",
                "flexcal verify robot.yaml others.csv",
                ("results.json", "points.csv", "arm.npz", "report.html"),
            ),
            Verb(
                ("repeatability",),
                "repeatability",
                "Repeatability",
                "pose accuracy and repeatability after ISO 9283, from repeated visits",
                "flexcal repeatability robot.yaml visits.csv",
                ("results.json", "report.html"),
            ),
            Verb(
                ("recheck",),
                "recheck",
                "Recheck",
                "whether the robot is still as calibrated, by about ten poses: what changed, and slow drifts over visits",
                "flexcal recheck robot.yaml visit.csv",
                ("visits.json", "plan.yaml", "results.json", "report.html"),
            ),
            Verb(
                ("map",),
                "map",
                "Map",
                "predicted accuracy over the working volume, and its sources",
                "flexcal map robot.yaml --verification others.csv --out map.html",
                page=True,
            ),
            Verb(
                ("compensate",),
                "compensate",
                "Compensate",
                "motor commands that bring the real tool to given targets",
                "flexcal compensate robot.yaml targets.csv --out commands.csv",
            ),
            Verb(
                ("filter",),
                "filter",
                "Filter",
                "a robot program whose targets are corrected",
                "flexcal filter robot.yaml program.script --out corrected.script",
            ),
            Verb(
                ("serve",),
                "serve",
                "Serve",
                "commands and poses for other programs on this machine, line by line",
                "flexcal serve robot.yaml --unix robot.sock",
            ),
            Verb(
                ("predict",),
                "predict",
                "Predict",
                "position of the real tool for motor commands, under its payload",
                "flexcal predict robot.yaml commands.csv --out tool.csv",
            ),
            Verb(
                ("certificate",),
                "certificate",
                "Certificate",
                "accuracy before and after compensation at the same targets, on two sheets of A4",
                "flexcal certificate robot.yaml --targets targets.csv --before nominal.csv --after compensated.csv",
            ),
            Verb(
                ("report",),
                "report",
                "Report",
                "the report of a folder that one of these verbs wrote with --out, from its stored numbers",
                "flexcal report results",
            ),
            *EXPORTS,
        ),
    ),
    Step(
        "Many robots, measured again and again",
        (
            Verb(
                ("fleet",),
                "fleet",
                "Fleet",
                "results of many robots in one table: who is out of tolerance, who drifts, who differs",
                "flexcal fleet robots --out fleet.parquet",
                page=True,
            ),
        ),
    ),
    Step(
        "Run it many times",
        (
            Verb(
                ("study",),
                "study",
                "Study",
                "many calibrations over seeds, options or resampled data, on all cores or a Dask cluster; a row of a table each",
                "flexcal study study.yaml --out study",
                ("tasks.parquet", "results.json", "report.html"),
                interactive=True,
            ),
        ),
    ),
    Step(
        "All of it in a window",
        (
            Verb(
                ("studio",),
                "studio",
                "Studio",
                "a project folder in the browser: the same files and computations, step by step",
                "flexcal studio robot",
                interactive=True,
            ),
        ),
    ),
    Step(
        "For the shell",
        (
            Verb(
                ("completion",),
                "completion",
                "Completion",
                "completion of verbs, options and their choices for bash, zsh or fish",
                "flexcal completion bash",
            ),
        ),
    ),
)

VERBS = tuple(verb for step in STEPS for verb in step.verbs)


def overview(group: str | None = None) -> str:
    """The help page: the procedure, step by step, with an example for every verb; only the verbs of `group` where given."""
    lines = [
        f"usage: flexcal {group or 'VERB'} {'WHAT ' if group else ''}[OPTIONS] ...",
        "",
        "flexcal makes a robot accurate: from its URDF and measurements made on it to its stiffness and true geometry.",
    ]
    for step in STEPS:
        verbs = [verb for verb in step.verbs if group in (None, verb.words[0])]
        if not verbs:
            continue
        lines += ["", step.title]
        for verb in verbs:
            lines += [f"  {verb.name:<20}{verb.summary}", f"  {'':<20}  $ {verb.example}"]
    lines += [
        "",
        "Every verb has --help, and --json: one JSON document on standard output, messages on standard error.",
        "Exit status: 0 done, 2 an input cannot be used (one sentence says why), 130 interrupted.",
    ]
    return "\n".join(lines)


def find_verb(arguments: Sequence[str]) -> Verb | None:
    """The verb that the arguments begin with."""
    matches = [verb for verb in VERBS if tuple(arguments[: len(verb.words)]) == verb.words]
    return matches[0] if matches else None


def command_class(verb: Verb) -> type[Any]:
    """The dataclass of a verb's arguments, whose `run` carries it out."""
    return getattr(import_module(f"flexcal.cli.verbs.{verb.module}"), verb.command)


def unknown_verb(arguments: Sequence[str]) -> FlexcalError:
    """Error of a verb that does not exist, with the nearest that do."""
    word = arguments[0]
    groups = {verb.words[0] for verb in VERBS if len(verb.words) > 1}
    if word in groups:
        known = [verb.words[1] for verb in VERBS if verb.words[0] == word]
        if len(arguments) < 2 or arguments[1].startswith("-"):
            return FlexcalError(
                "E-CLI-040",
                f"'{word}' needs to know what: {_either(f'flexcal {word} {what}' for what in known)}.",
            )
        near = difflib.get_close_matches(arguments[1], known, n=1, cutoff=0.4) or known
        meant = _either(f"flexcal {word} {what}" for what in near)
        return FlexcalError("E-CLI-041", f"there is no '{word} {arguments[1]}'; did you mean {meant}?")
    names = {verb.name: verb.name for verb in VERBS} | {verb.words[-1]: verb.name for verb in VERBS}
    names |= {group: group for group in groups} | _ALSO_CALLED
    tried = " ".join(arguments[:2])
    near = difflib.get_close_matches(tried, names, n=1, cutoff=0.7) or difflib.get_close_matches(
        word, names, n=1, cutoff=0.6
    )
    hint = f"did you mean 'flexcal {names[near[0]]}'?" if near else "'flexcal --help' lists the verbs."
    return FlexcalError("E-CLI-018", f"there is no verb '{word}'; {hint}")


_ALSO_CALLED = {
    "fit": "calibrate",
    "calibration": "calibrate",
    "validate": "verify",
    "check": "verify",
    "test": "verify",
    "record": "measure",
    "simulate": "measure",
    "plan": "design frequency",
    "frf": "identify response",
    "damping": "identify stiffness",
    "correct": "compensate",
    "apply": "compensate",
    "accuracy": "map",
}


def _either(names: Iterable[str]) -> str:
    return " or ".join(f"'{name}'" for name in names)
