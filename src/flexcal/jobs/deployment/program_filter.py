"""Programs whose targets are replaced by those that bring the real tool there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.compensation import ToolPoseTarget, motor_commands, nominal_joint_positions
from flexcal.data.poses import ToolTargets
from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import provenance
from flexcal.jobs.deployment.controller_joints import ControllerJoints
from flexcal.jobs.deployment.controller_poses import ControllerPoses
from flexcal.jobs.deployment.filtered_program import FilteredProgram, ToolPoses
from flexcal.jobs.deployment.path_corrections import PathCorrections, deviations_of_targets, path_remarks
from flexcal.jobs.deployment.program_files import output_places, read_program, written_files
from flexcal.jobs.inputs import CalibratedRobot, beyond_calibration, beyond_remark, held_at, use_remarks
from flexcal.jobs.result_files import RunRecord
from flexcal.model.robot import RobotModel, with_point_at_frame
from flexcal.model.statics import tool_at_rest
from flexcal.programs import Dialect, Pose, Program
from flexcal.units import MILLIMETRE

_BASE_ERROR = 1e-3
"""Distance (m) from which on a base frame is another one."""
_FLANGE = "tool0"
"""Frame of a Universal Robots' URDF in which the controller gives tools."""


def filter_program(
    robot: CalibratedRobot,
    program: Program,
    *,
    tool: Sequence[float] = (),
    start: Sequence[float] = (),
    signs: Sequence[float] = (),
    zeros: Sequence[float] = (),
    flange: str = _FLANGE,
    reverse: bool = False,
    subdivide: float | None = None,
    temperature: float | None = None,
) -> FilteredProgram:
    """Replace the targets of a program by those with which the real robot's flange takes the poses that the nominal robot would take.

    Joint positions become compensated commands. A pose becomes the one at which the controller, whose kinematics are taken to be those of
    the URDF, computes the compensated command. The arm has the configuration of the joint positions beside the pose, else that in which it
    arrives from the target before it in the text.

    Parameters
    ----------
    robot : CalibratedRobot
        The robot, with six joints.
    program : Program
        Its program.
    tool : sequence of float
        Tool centre point in the flange, for poses where the program says none, as the dialect writes a pose.
    start : sequence of float
        Joint positions (6,), as the dialect writes them, whose configuration the poses have before which there are none.
    signs : sequence of float
        Signs (6,), ±1, and
    zeros : sequence of float
        Zeros (6,) of joints, in the dialect's units: q_URDF = sign · q_controller + zero. Default: 1 and 0.
    flange : str
        URDF frame of the flange.
    reverse : bool
        Whether to return from corrected targets to the nominal ones.
    subdivide : float, optional
        Distance, m, by which a line may miss the needed correction between its ends; points are inserted where it misses it by more.
    temperature : float, optional
        Temperature of the arm, °C; by default that at which the calibrated parameters hold.

    Returns
    -------
    FilteredProgram
        `files` is the new program, `write(path)` writes it, `report(path)` a page; `summary()` names what stays as it is.

    Raises
    ------
    FlexcalError
        For a robot without six joints, and a frame that the URDF lacks.
    InputError
        For `subdivide` that is not positive, or given with `reverse`.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from flexcal import RobotModel, calibrate, filter_program, read_poses, read_program
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "a.script").write_text("movej([-0.4, -1.2, 1.9, -2.2, -1.5, 0.2], a=1.4)")
    >>> filtered = filter_program(robot, read_program(folder / "a.script"))
    >>> filtered.files[0].text.startswith("movej([-0.")
    True
    >>> [place.name for place in filtered.write(folder / "b.script")]
    ['b.script']
    """
    if subdivide is not None and (reverse or not subdivide > 0):
        raise InputError(
            "E-PROG-011",
            f"--subdivide {subdivide / MILLIMETRE:g} needs a positive number of millimetres, and no --reverse; correct the command.",
        )
    probable, warm = held_at(robot, temperature)
    model, nominal = (with_point_at_frame(each, flange) for each in (probable, robot.with_points))
    if model.n != 6:
        raise FlexcalError(
            "E-PROG-002",
            f"{model.name} has {model.n} joints, but targets of these programs have six numbers; use the robot.yaml of the six-joint arm.",
        )
    joints = _controller_joints(nominal, program.dialect, signs, zeros)
    beginning = _checked("start", start, 6, "joint positions")
    places = ControllerPoses(
        joints,
        flange,
        _tool(program.dialect, tool),
        None if beginning is None else joints.to_urdf(beginning),
    )
    q, reasons = places.joints(program.targets)
    commands, new = np.full((len(q), 6), np.nan), {}
    rows = np.array([k for k, reason in enumerate(reasons) if not reason], dtype=int)
    if len(rows):
        masses, payload_remarks = _payloads(model, program, rows)
        targets = ToolTargets(rows, np.full(len(rows), flange), q[rows], payload=masses)
        commands[rows], failures = (_nominal if reverse else _commands)(model, nominal, targets)
        for row, failure in zip(rows.tolist(), failures, strict=True):
            reasons[row] = failure
        done = np.array([k for k in rows if not reasons[k]], dtype=int)
        commands[[k for k in rows if reasons[k]]] = np.nan
        numbers = places.new_numbers([program.targets[k] for k in done], q[done], commands[done])
        new = dict(zip(done.tolist(), numbers, strict=True))
    else:
        done, masses, payload_remarks = rows, None, ()
    paths = PathCorrections(model, places, program, q, commands, _by_target(masses, rows, len(q)))
    deviations = np.full(len(program.moves), np.nan) if reverse else paths.deviations()
    between = {} if subdivide is None else paths.divisions(deviations, subdivide)
    missed = deviations_of_targets(program.moves, deviations, len(q))
    before, corrected = (ToolPoses.of(places, program.targets, each) for each in (q, commands))
    remarks = (
        *use_remarks(robot),
        *warm,
        *_convention_remarks(joints),
        *_tool_remarks(program, places.tool),
        *program.remarks,
        *payload_remarks,
        *path_remarks(program, deviations, subdivide, between),
        *beyond_remark(robot, beyond_calibration(robot, commands[done]), "targets"),
    )
    return FilteredProgram(
        model, program, new, between, missed, commands, before, corrected, tuple(reasons), remarks, reverse
    )


def filter_program_file(
    robot_file: Path,
    files: Sequence[Path],
    out: Path | None,
    *,
    estimates: Path | None = None,
    tool: Sequence[float] = (),
    start: Sequence[float] = (),
    signs: Sequence[float] = (),
    zeros: Sequence[float] = (),
    flange: str = _FLANGE,
    reverse: bool = False,
    subdivide: float | None = None,
    temperature: float | None = None,
    page: Path | None = None,
    command: str = "",
) -> FilteredProgram:
    """`filter_program` for files, and those that belong to them; the new program goes to `out`, or nowhere (None), a page to `page`.

    It is the old one byte for byte but for the numbers: one file to the file `out`, several into the folder `out` under their names.
    """
    program = read_program(*files)
    sources = [Path(file.name) for file in program.files]
    if not (program.targets or program.computed or program.remarks):
        raise InputError(
            "E-PROG-016",
            f"{sources[0]} has no motion in {program.dialect.name}; check that the file is in that language, and its encoding.",
        )
    if out is not None:
        _refuse_own_output(sources, output_places(written_files(sources), out))
    if page is not None and page.suffix.lower() != ".html":
        raise InputError("E-PROG-012", f"{page} must end in .html; give another --report.")
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    result = filter_program(
        robot,
        program,
        tool=tool,
        start=start,
        signs=signs,
        zeros=zeros,
        flange=flange,
        reverse=reverse,
        subdivide=subdivide,
        temperature=temperature,
    )
    origin = provenance([robot_file, robot.nominal.urdf, *sources], None, robot.stored, tuple(robot.blocks))
    result = replace(result, record=RunRecord(origin, command))
    if page is not None:
        result.report(page)
    if out is not None:
        result.write(out)
    return result


def _refuse_own_output(sources: Sequence[Path], places: Sequence[Path]) -> None:
    """Raise `InputError` where the new program would replace the old one, which could then be corrected twice."""
    for place in places:
        if place.exists() and any(source.exists() and source.samefile(place) for source in sources):
            raise InputError(
                "E-PROG-017",
                f"{place} is the program itself, which stays; give another --out (where it is corrected already, --reverse leads back).",
            )


def _controller_joints(
    nominal: RobotModel, dialect: Dialect, signs: Sequence[float], zeros: Sequence[float]
) -> ControllerJoints:
    sign, zero = _checked("joint-signs", signs, 6, "signs"), _checked("joint-zeros", zeros, 6, "angles")
    if sign is not None and set(np.abs(sign).tolist()) != {1.0}:
        raise InputError(
            "E-PROG-010", f"--joint-signs has values other than 1 and -1 ({sign}); give six of these."
        )
    plain = ControllerJoints(nominal, dialect, np.ones(6) if sign is None else sign, np.zeros(6))
    return plain if zero is None else replace(plain, zeros=zero * plain.unit)


def _tool(dialect: Dialect, tool: Sequence[float]) -> Pose | None:
    numbers = _checked("tool", tool, 3 + dialect.notation.orientation.count, f"a pose in {dialect.name}")
    return None if numbers is None else dialect.notation.pose(numbers.tolist())


def _checked(name: str, values: Sequence[float], count: int, meaning: str) -> np.ndarray | None:
    if len(values) not in (0, count):
        raise InputError("E-PROG-003", f"--{name} has {len(values)} values; give the {count} of {meaning}.")
    if not np.isfinite(values).all():
        raise InputError("E-PROG-018", f"--{name} has a value that is no finite number; correct it.")
    return np.array(values, dtype=float) if len(values) else None


def _convention_remarks(joints: ControllerJoints) -> tuple[str, ...]:
    """What is taken of the signs and zeros of the joints and of the base frame, for dialects whose arms have them by custom."""
    if joints.dialect.zero is None:
        return ()
    remarks, name = [], joints.dialect.name
    if differing := joints.differing():
        remarks.append(
            f"joint positions and configuration data count as those of the URDF, but its arm at zero is not that of {name}: "
            f"{differing}; give --joint-signs and --joint-zeros if the controller counts otherwise"
        )
    if abs(height := joints.base_error()) > _BASE_ERROR:
        remarks.append(
            f"poses count in the frame base of the URDF, else in its root, and axis 2 lies {height / MILLIMETRE:.1f} mm above it, but the "
            f"base frame of {name} lies at the height of axis 2; add a fixed frame 'base' there to the URDF"
        )
    return tuple(remarks)


def _tool_remarks(program: Program, tool: Pose | None) -> tuple[str, ...]:
    """That one given tool stands for several which the program does not say."""
    missing = dict.fromkeys(
        target.missing for target in program.targets if target.tool is None and not target.joints
    )
    if tool is None or len(missing) < 2:
        return ()
    return (f"--tool stands for {len(missing)} tools that the program does not say ({'; '.join(missing)})",)


def _by_target(masses: np.ndarray | None, rows: np.ndarray, count: int) -> np.ndarray | None:
    """Masses (count,) of the targets; None where robot.yaml knows of no payload."""
    if masses is None:
        return None
    every = np.full(count, np.nan)
    every[rows] = masses
    return every


def _payloads(
    model: RobotModel, program: Program, rows: np.ndarray
) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Masses (N,), kg, that the arm carries at the targets; None where robot.yaml knows of no payload."""
    said = [program.targets[k].payload for k in rows]
    if model.payload is None:
        if any(said):
            return None, (
                f"the program sets payloads of up to {max(mass or 0.0 for mass in said):g} kg, but robot.yaml declares none, so that the "
                "deflection under them is not corrected: add `payload:`",
            )
        return None, ()
    return np.array([model.payload.mass if mass is None else mass for mass in said]), ()


def _commands(model: RobotModel, nominal: RobotModel, targets: ToolTargets) -> tuple[np.ndarray, list[str]]:
    """Compensated commands (N, 6) and why one has none."""
    commands = motor_commands(model, nominal, targets)
    return commands.q, [str(reason) for reason in commands.reason]


def _nominal(model: RobotModel, nominal: RobotModel, targets: ToolTargets) -> tuple[np.ndarray, list[str]]:
    """Joint positions (N, 6) at which the nominal robot stands as the real one does at its commands, and why there are none."""
    assert targets.q is not None
    at = tool_at_rest(model, targets.q, targets.payload, targets.target).kinematics
    aim = ToolPoseTarget(targets.target, at.position, at.orientation)
    return nominal_joint_positions(nominal, aim, targets.q)
