"""Export of the calibrated robot to file formats of other programs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.dynamics.torque_model import TorqueModel
from flexcal.errors import FlexcalError, InputError
from flexcal.export import (
    FORMATS,
    SAMPLES,
    Convention,
    DrawPoses,
    ExportedFile,
    RenderedModel,
    drawing_limits,
    random_poses,
    render,
    render_dh,
    render_mjcf,
    render_offsets,
    render_representable,
    render_runtime,
    undetermined_offsets,
    write_rendered,
)
from flexcal.files.formats import read_estimates
from flexcal.jobs.deployment.actuator_export import actuator_remarks, identified_actuators, rendered_actuators
from flexcal.jobs.deployment.holding_ranges import calibrated_ranges, holding_ranges
from flexcal.jobs.inputs import (
    CalibratedRobot,
    beyond_calibration,
    beyond_remark,
    held_at,
    stored_estimates,
    use_remarks,
)
from flexcal.jobs.pages import Result
from flexcal.model.robot import RobotModel, with_blocks

_CONVENTIONS: dict[str, Convention] = {"dh": "standard", "mdh": "modified"}
_NOMINAL_TORQUES = "No dynamics were identified: the torques of the runtime are those of the URDF's links and robot.yaml's friction."
_HEADERS = (".h", ".hpp")
_ENOUGH = 200
"""Poses to which a robot can be fitted."""
_WHOLE = 0.8
"""Share of a joint's range from which the poses of a calibration have the whole of it."""
_OPTIONS = {
    "point": ("dh", "mdh", "offsets"),
    "four_parameters": ("dh", "mdh"),
    "keep_frames": ("offsets",),
    "time_step": ("isaac",),
}
"""Formats that take an option."""


@dataclass(frozen=True, eq=False, repr=False)
class ExportedRobot(Result):
    """Result of `export_robot`: the `export`ed file with its loss.

    `model` is the robot as exported; `calibrated` is False where there is no calibration: the joints are then those of the nominal robot.
    """

    export: ExportedFile
    calibrated: bool

    @property
    def path(self) -> Path:
        """The file."""
        return self.export.path

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the terms that the file does not carry."""
        return self.export.lost

    @property
    def headline(self) -> str:
        """The file, and what it does not carry."""
        return f"{self.path.name}, without {', '.join(self.lost) or 'any loss'}"

    def summary(self) -> str:
        """The file, its loss in millimetres, and remarks."""
        return str(self.export)

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "file": self.export.path,
            "calibrated": self.calibrated,
            **self.export.loss.document,
            "remarks": list(self.export.remarks),
            **self.export.table,
        }


def export_robot(
    robot: CalibratedRobot,
    path: str | Path,
    format: str,
    *,
    point: str | None = None,
    four_parameters: bool = False,
    keep_frames: bool = False,
    time_step: float | None = None,
    temperature: float | None = None,
) -> ExportedRobot:
    """Write a calibrated robot in a file format of other programs, and measure the error due to the terms that the format lacks.

    The robot in the file is the one of that format that is nearest to the calibrated one at rest, over random poses of the working volume,
    or of the joint range, at which the calibration holds: its geometry makes up for the terms as far as it can.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    path : str or Path
        File to write.
    format : {"urdf", "mjcf", "sdf", "dh", "mdh", "offsets", "kinematics", "json", "runtime", "isaac"}
        URDF, MJCF, SDFormat, Denavit-Hartenberg table, standard or modified, joint offsets, kinematics of Universal Robots, everything, or
        what the C++ runtime reads: JSON, or a header with it where `path` ends in .h or .hpp. MJCF has the
        actuators where they were identified; "isaac" has nothing else.
    point : str, optional
        Point at the end of the chain, of tables and offsets; the first by default.
    four_parameters : bool
        Whether a table is without the Hayati parameter beta of nominally parallel axes.
    keep_frames : bool
        Whether base and tool stay nominal where offsets are fitted.
    time_step : float, optional
        Time step, s, in which "isaac" counts delays; 5 ms by default.
    temperature : float, optional
        Temperature of the arm, °C, for which the file is; by default that at which the calibrated parameters hold. "json" has the terms of
        temperature, and takes none.

    Returns
    -------
    ExportedRobot
        Its `path`, `lost`, `document()` with the content of tables, and `summary()`.

    Raises
    ------
    FlexcalError
        For an unknown format or point, an option that the format does not take, a robot that the format cannot describe, and where the
        file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from flexcal import RobotModel, calibrate, export_robot, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     exported = export_robot(robot, f"{folder}/dh.csv", "mdh")
    >>> exported.lost
    ()
    """
    _check_options(
        format,
        {
            "point": point,
            "four_parameters": four_parameters,
            "keep_frames": keep_frames,
            "time_step": time_step,
        },
    )
    if temperature is not None and format == "json":
        raise FlexcalError(
            "E-RUN-110", "the format 'json' has the terms of temperature in it; leave the temperature out."
        )
    probable, warm = held_at(robot, temperature)
    nominal = robot.nominal
    draw = poses_where_it_holds(robot, probable, near=format != "offsets")
    rendered: RenderedModel
    if format == "offsets":
        rendered = render_offsets(
            probable,
            nominal,
            point=point,
            keep_frames=keep_frames,
            undetermined=undetermined_zeros(robot),
            draw=draw,
        )
    elif format == "runtime":
        drives = TorqueModel.of_blocks(probable, robot.blocks)
        rendered = render_runtime(
            probable,
            robot.with_points,
            drives.document(),
            holds=holding_ranges(robot, probable),
            header=Path(path).suffix in _HEADERS,
        )
        rendered = replace(rendered, remarks=() if drives.identified else (_NOMINAL_TORQUES,))
    elif format == "isaac":
        rendered = rendered_actuators(robot, time_step)
    else:

        def rendering(model: RobotModel) -> RenderedModel:
            if format in _CONVENTIONS:
                return render_dh(
                    model,
                    nominal,
                    _CONVENTIONS[format],
                    point=point,
                    four_parameters=four_parameters,
                    unseen=robot.unseen if robot.targets else None,
                )
            if format == "mjcf":
                return render_mjcf(model, identified_actuators(robot))
            return render(format, model, nominal)

        rendered = render_representable(probable, rendering, draw)
    written = write_rendered(probable, path, rendered, nominal=nominal, draw=draw)
    remarks = (
        *use_remarks(robot),
        *_extent_remark(robot, rendered),
        *actuator_remarks(robot, format),
        *warm,
    )
    written = replace(written, remarks=(*written.remarks, *remarks))
    return ExportedRobot(probable, written, "calibration" in robot.blocks)


def export_stored_robot(
    robot_file: Path,
    out: Path,
    format: str,
    *,
    point: str | None = None,
    four_parameters: bool = False,
    keep_frames: bool = False,
    time_step: float | None = None,
    temperature: float | None = None,
    estimates: Path | None = None,
) -> ExportedRobot:
    """`export_robot` of the robot of a robot.yaml, as far as it was identified; `estimates` is a file or folder in place of that beside it.

    Raises `FlexcalError` as reading and `export_robot` do, and where `out` is one of the robot's own files.
    """
    robot = identified_robot(robot_file, estimates)
    nominal, path = robot.nominal, robot.stored
    for own, what in ((nominal.urdf, "nominal URDF"), (robot_file, "robot.yaml"), (path, "estimates file")):
        if own is not None and out.exists() and own.exists() and out.samefile(own):
            raise InputError(
                "E-RUN-021",
                f"{out} is the {what} of {robot_file}, which is never changed; give another --out.",
            )
    return export_robot(
        robot,
        out,
        format,
        point=point,
        four_parameters=four_parameters,
        keep_frames=keep_frames,
        time_step=time_step,
        temperature=temperature,
    )


def identified_robot(robot_file: Path, estimates: Path | None) -> CalibratedRobot:
    """The robot of a robot.yaml as far as it was identified; `estimates` is a file or folder in place of that beside it.

    Raises `FlexcalError` as reading does, and where the named estimates do not exist.
    """
    nominal = RobotModel.from_yaml(robot_file, estimates=False)
    path = stored_estimates(nominal, estimates)
    if path.exists():
        blocks = read_estimates(path)
        return CalibratedRobot(nominal, with_blocks(nominal, blocks, path), blocks, path)
    if estimates is not None:
        raise InputError(
            "E-RUN-022", f"{path} does not exist; run 'flexcal calibrate' first, or leave --estimates out."
        )
    return CalibratedRobot(nominal, nominal, {}, None)


def _check_options(format: str, options: dict[str, object]) -> None:
    names = [each.name for each in FORMATS]
    if format not in names:
        raise FlexcalError("E-RUN-099", f"the format '{format}' is unknown; give one of {', '.join(names)}.")
    for option, value in options.items():
        if value and format not in _OPTIONS[option]:
            raise FlexcalError(
                "E-RUN-100",
                f"the format '{format}' takes no {option}, which {', '.join(_OPTIONS[option])} do; leave it out.",
            )


def _extent_remark(robot: CalibratedRobot, rendered: RenderedModel) -> tuple[str, ...]:
    """Remark on poses for which the file is and where the calibration does not hold; none without geometry or points."""
    if rendered.tool is None or not robot.probable.points:
        return ()
    q, within = random_poses(robot.probable, rendered.point, np.random.default_rng(0))
    targets = np.full(len(q), robot.probable.point(rendered.point).name)
    return beyond_remark(robot, beyond_calibration(robot, q, targets), f"random poses of the {within}")


def poses_where_it_holds(robot: CalibratedRobot, model: RobotModel, *, near: bool = True) -> DrawPoses:
    """Random poses of `model`, the calibrated `robot` or that at another temperature, at which the calibration holds.

    They are those of the working volume or, without one, of the joint range; all, where it holds at hardly any. Where the poses of the
    calibration are of a part of the joints' ranges, as many more are within these if `near`.
    """
    ranges = _partial_ranges(robot, model) if near else None

    def draw(point: str | None, rng: np.random.Generator) -> tuple[np.ndarray, str]:
        q, within = random_poses(model, point, rng)
        targets = np.full(len(q), model.point(point).name)
        far = q[beyond_calibration(robot, q, targets) == 0]
        where = within if len(far) == len(q) else f"{within} where the calibration holds"
        if ranges is not None:
            inside, there = random_poses(model, point, rng, ranges)
            if there == within:
                far, inside = far[: SAMPLES // 2], inside[: SAMPLES // 2]
                among = f"{where}, {len(inside)} of them" if len(far) else f"{within}, all"
                return np.concatenate([far, inside]), f"{among} within the joint ranges of the calibration"
        return (far, where) if len(far) >= _ENOUGH else (q, within)

    return draw


def _partial_ranges(robot: CalibratedRobot, model: RobotModel) -> np.ndarray | None:
    """Lower and upper ends (2, n) of the joints at the poses of the calibration; None if unknown, or most of what the joints can."""
    ranges, (lower, upper) = calibrated_ranges(robot, model), drawing_limits(model)
    if ranges is None or (ranges[1] - ranges[0] > _WHOLE * (upper - lower)).all():
        return None
    return np.clip(ranges, lower, upper)


def undetermined_zeros(robot: CalibratedRobot) -> tuple[int, ...]:
    """Joints whose zeros the measured points do not tell; before an instrument with a frame of its own the base is anywhere."""
    if not robot.measured:
        return ()
    registered = bool(robot.probable.stations.pose[:, 3:].any())
    return undetermined_offsets(robot.nominal, robot.measured, base=registered)
