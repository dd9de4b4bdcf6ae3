"""Export of the calibrated robot into the xacro files or the URDF that describe it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.errors import InputError, unreadable
from flexcal.export import (
    AT_REST,
    ExportErrors,
    XacroExport,
    XacroSource,
    Zeros,
    measure_export_error,
    render_xacro,
    representable_robot,
    shifted_limits,
)
from flexcal.files.transaction import MEGABYTE, atomic_path, read_bytes
from flexcal.jobs.deployment.export import identified_robot, poses_where_it_holds
from flexcal.jobs.inputs import held_at, use_remarks
from flexcal.jobs.pages import Result


@dataclass(frozen=True, eq=False, repr=False)
class ExportedXacro(Result):
    """Result of `export_xacro`.

    `files` has the content of all files by their paths below the folder to write, `main` first, and `changes` what each changed one got.
    """

    export: XacroExport
    loss: ExportErrors
    files: Mapping[Path, bytes]
    main: Path
    changes: Mapping[Path, tuple[str, ...]]
    remarks: tuple[str, ...]
    calibrated: bool

    @property
    def headline(self) -> str:
        """Number of files with other numbers."""
        return f"{len(self.changes)} of {len(self.files)} files have other numbers"

    def summary(self) -> str:
        """What each file got, the loss in millimetres, and remarks."""
        lines = [f"{path}: {'; '.join(said)}" for path, said in self.changes.items()]
        return "\n".join([self.headline, *lines, *self.loss.sentences, *self.remarks])

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "main": self.main,
            "files": [{"file": path, "changes": list(self.changes.get(path, ()))} for path in self.files],
            "calibrated": self.calibrated,
            **self.loss.document,
            "points": {
                name: {"link": link, "xyz": list(xyz), "rpy": list(rpy)}
                for name, (link, xyz, rpy) in self.export.points.items()
            },
            "remarks": list(self.remarks),
        }


def export_xacro(
    robot_file: Path,
    out: Path,
    *,
    xacro: Path | None = None,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, Path] | None = None,
    zeros: Zeros = "origins",
    joint_limits: Path | None = None,
    temperature: float | None = None,
    estimates: Path | None = None,
) -> ExportedXacro:
    """Write the files of a robot's description with calibrated numbers into the folder `out`, every other byte as it was.

    Parameters
    ----------
    robot_file : Path
        robot.yaml.
    out : Path
        Folder for all files of the description, changed or not, as they lie to each other.
    xacro : Path, optional
        Main xacro file, or a URDF; the URDF of robot.yaml by default.
    arguments, packages : mapping, optional
        Values of xacro's arguments, and folders of ROS packages.
    zeros : {"origins", "ros2_control"}
        Where the offsets of the joints go.
    joint_limits : Path, optional
        MoveIt's joint_limits.yaml, whose positions move with the offsets in ros2_control.
    temperature : float, optional
        Temperature of the arm, °C; by default that at which the calibrated parameters hold.
    estimates : Path, optional
        estimates.yaml or its folder, in place of that beside robot.yaml.

    Returns
    -------
    ExportedXacro
        What each file got, and the error of the whole.

    Raises
    ------
    InputError
        For files that cannot be read or expanded, that describe another robot, and for limits without offsets.
    FlexcalError
        Where a number cannot be replaced so that nothing else changes.
    """
    if joint_limits is not None and zeros == "origins":
        raise InputError(
            "E-ROS-016",
            f"{joint_limits} stays valid while the zeros are in the origins; give --zeros ros2_control, or leave --joint-limits out.",
        )
    robot = identified_robot(robot_file, estimates)
    model, warm = held_at(robot, temperature)
    source = XacroSource(xacro or robot.nominal.urdf, arguments or {}, packages or {})
    draw = poses_where_it_holds(robot, model)
    written, said = representable_robot(model, AT_REST, draw)
    export = render_xacro(written, robot.nominal, source, zeros)
    loss = measure_export_error(model, export.tool, AT_REST, nominal=robot.nominal, draw=draw)
    folder, files, changes, main = _below_one_folder(export)
    remarks = [*said, *export.remarks, *use_remarks(robot), *warm]
    if joint_limits is not None:
        offsets = dict(zip(written.joint_names, written.joint_offsets.tolist(), strict=True))
        try:
            content = read_bytes(joint_limits, limit=MEGABYTE)
        except OSError as problem:
            raise unreadable(joint_limits, problem) from problem
        own = Path(os.path.abspath(joint_limits))
        place = own.relative_to(folder) if own.is_relative_to(folder) else Path(own.name)
        files[place], said, left = shifted_limits(joint_limits, content, offsets)
        changes[place] = said
        if left:
            remarks.append(
                f"{joint_limits.name} has no positions of {', '.join(left)}: MoveIt takes those of the URDF, which have moved."
            )
    for path in files:
        _require_own_place(out, path)
    for path, content in files.items():
        with atomic_path(out / path) as temporary:
            temporary.write_bytes(content)
    return ExportedXacro(
        model, export, loss, files, main, changes, tuple(remarks), "calibration" in robot.blocks
    )


def _require_own_place(out: Path, path: Path) -> None:
    """Raise `InputError` for a file that would be hidden, and where a link in the folder `out` leads out of it."""
    if any(part.startswith(".") for part in path.parts):
        raise InputError(
            "E-ROS-044",
            f"{path}, which the description reads, is hidden, and no such file is written; rename it.",
        )
    for folder in list(path.parents)[:-1]:
        if (out / folder).is_symlink():
            raise InputError(
                "E-ROS-045",
                f"{out / folder} is a link, through which no file of a description is written; remove it, or give another --out.",
            )


def _below_one_folder(
    export: XacroExport,
) -> tuple[Path, dict[Path, bytes], dict[Path, tuple[str, ...]], Path]:
    """The folder that has all files, the files by their paths below it, what changed in them, and the main one.

    Unchanged files of other ROS packages are left out: the description finds them where they are.
    """
    description = export.description
    contents, changes = description.contents, description.changes
    main = next(iter(contents))
    others = [folder for folder in description.expansion.packages if not main.is_relative_to(folder)]
    own = [
        path
        for path in contents
        if path in changes or not any(path.is_relative_to(other) for other in others)
    ]
    folder = Path(os.path.commonpath([path.parent for path in own]))
    files = {path.relative_to(folder): contents[path] for path in own}
    return (
        folder,
        files,
        {path.relative_to(folder): said for path, said in changes.items()},
        main.relative_to(folder),
    )
