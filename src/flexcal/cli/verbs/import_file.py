"""`flexcal import`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import (
    Json,
    MaybeNumber,
    MaybePath,
    MaybeText,
    Robot,
    Texts,
    require_robot,
)
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.jobs.setup import ImportedFile

_MOVED = 0.002
"""A point that fits better so far (m) from where it was declared is worth a word."""


@dataclass(frozen=True)
class Import:
    """Convert measurements with other column names and units to flexcal's, in SI units: measured poses, or a joint log.

    FILE is delimited text, Excel, MAT, Parquet, a universal file, or a ROS recording (MCAP, rosbag2). Columns are recognised by
    joint names, usual words and numbers; units by the headers, else by magnitude. The first rows are shown as they were
    read, and columns that are left out are listed. Without --out nothing is written.

    The nominal robot is then registered with the points by best fit. If the residuals are too large, nothing is written, and an explanation
    is proposed.
    """

    robot: Robot
    file: Annotated[Positional[Path], arg(metavar="FILE", help="the measurements; of a rosbag2, the folder")]
    map: Annotated[Texts, arg(metavar="NAME=COLUMN...", help_behavior_hint="(default: as recognised)")] = ()
    """Meaning of columns: q2=-J2[deg]+90 x=X[mm] tau1=12.5*I1[A] temperature=none, in quotes where there are spaces."""
    out: Annotated[
        MaybePath, arg(metavar="FILE", help_behavior_hint="(default: only show how the file is read)")
    ] = None
    """The file to write, CSV or Parquet."""
    sigma: Annotated[
        MaybeNumber, arg(metavar="MM", help_behavior_hint="(default: as in the file, else unknown)")
    ] = None
    """The instrument's 1σ per coordinate, mm, for a file that does not state it."""
    orientation: Annotated[
        MaybeText, arg(metavar="NAME", help_behavior_hint="(default: as the nominal robot tells)")
    ] = None
    """Convention of measured orientations: xyz-extrinsic, zyx-intrinsic …, rotation-vector, wxyz, xyzw; each also with -transposed."""
    sheet: Annotated[
        MaybeText,
        arg(metavar="NAME", help_behavior_hint="(default: the first)"),
    ] = None
    """Sheet of an Excel file."""
    topic: Annotated[
        MaybeText,
        arg(metavar="NAME", help_behavior_hint="(default: the only one)"),
    ] = None
    """Topic of the measured points in a ROS recording."""
    lerobot: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """LeRobot's calibration (JSON) of the motors that the columns are of."""
    motors: Annotated[
        Texts, arg(metavar="JOINT=MOTOR...", help_behavior_hint="(default: of the same name)")
    ] = ()
    """Motors of joints with other names, or other signs and zeros: shoulder_lift=-lift+90 (degrees)."""
    readings: Literal["ticks", "degrees", "percent"] = "ticks"
    """What was recorded of the motors: ticks, or LeRobot's degrees or percent of the range (-100 to 100)."""
    unchecked: bool = False
    """Write although the points do not fit the nominal robot."""
    write_signals: bool = False
    """Also append the block 'signals:' to robot.yaml, so that files with these columns can be read without import."""
    write_point: bool = False
    """Also write the position of the measured point that fits the nominal robot best to robot.yaml, as its `xyz`."""
    json: Json = False

    def run(self) -> None:
        """Import, and show how the columns were read."""
        from flexcal.cli.tables.imported_columns import first_rows_table
        from flexcal.importing.columns import reasons_unused
        from flexcal.jobs.setup import MotorReadings, import_file

        require_robot(self.robot, self.file)
        if self.motors and self.lerobot is None:
            raise InputError("E-ROS-032", "--motors goes with --lerobot FILE; give both, or --map.")
        console = Console(self.json)
        imported = import_file(
            self.robot,
            self.file,
            mapped=self.map,
            out=self.out,
            sigma=None if self.sigma is None else self.sigma * MILLIMETRE,
            sheet=self.sheet,
            topic=self.topic,
            orientation=self.orientation,
            unchecked=self.unchecked,
            motors=None if self.lerobot is None else MotorReadings(self.lerobot, self.motors, self.readings),
        )
        console.show(first_rows_table(imported))
        for left in reasons_unused(imported.left_out):
            console.say(f"left out: {left}")
        for remark in imported.remarks:
            console.say(remark)
        self._say_fit(console, imported)
        if not imported.trusted and not self.unchecked:
            if self.json:
                console.say(f"read as --map {' '.join(imported.mapped())}")
            raise InputError("E-CLI-035", self._doubt(imported))
        if self.write_point:
            self._write_point(console, imported)
        if self.write_signals:
            self._add_signals(console, imported)
        if self.out is not None:
            rows = len(next(iter(imported.columns.values())))
            console.say(f"wrote {self.out}: {rows} rows")
        console.finish(imported.document(), self._following(imported))

    def _say_fit(self, console: Console, imported: ImportedFile) -> None:
        fit = imported.misfit
        if fit is None:
            return
        console.say(
            f"the nominal robot, best-fit registered, has residuals of {fit.rms / MILLIMETRE:.2f} mm (rms)"
        )
        shift = float(((fit.moved - fit.declared) ** 2).sum() ** 0.5)
        if not fit.doubtful and shift > _MOVED and fit.moved_rms < 0.5 * fit.rms:
            place = ", ".join(f"{value:.3f}" for value in fit.moved)
            console.say(
                f"with the point {fit.point} at [{place}] in its frame only {fit.moved_rms / MILLIMETRE:.2f} mm: "
                f"check its xyz under `points:` in {self.robot}"
                + (
                    ""
                    if self.write_point
                    else "; --write-point writes this there (calibrate finds it more exactly)"
                )
            )

    def _write_point(self, console: Console, imported: ImportedFile) -> None:
        from flexcal.jobs.setup import write_point_position

        fit = imported.misfit
        if fit is None or fit.doubtful:
            raise InputError(
                "E-CLI-036",
                f"{self.file}: these points do not determine the position of the reflector on the tool; leave --write-point out.",
            )
        write_point_position(self.robot, fit.point, fit.moved)
        console.say(f"wrote the xyz of {fit.point} to {self.robot}")

    def _doubt(self, imported: ImportedFile) -> str:
        fit = imported.misfit
        assert fit is not None
        share = f"{100 * fit.moved_rms / fit.reach:.0f} % of its reach"
        what = f"{self.file}: the points do not fit this robot as the columns are read: the residuals are {share}"
        if not fit.proposal:
            check = f"check the order, units and signs of the columns, and the point's frame in {self.robot}"
            return f"{what}; {check}, or write them with --unchecked."
        if not fit.supported:
            return f"{what}; {fit.proposal}."
        options = "".join(f" '{option}'" for option in fit.options)
        return (
            f"{what}; {fit.proposal}"
            + (f": --map{options}" if options else "; correct it with --map, as z=-COLUMN")
            + "."
        )

    def _add_signals(self, console: Console, imported: ImportedFile) -> None:
        from flexcal.data.tables import TIMESTAMP
        from flexcal.jobs.setup import add_signals

        if not imported.signals:
            console.say("robot.yaml needs no `signals:` for these columns")
            return
        add_signals(self.robot, imported.signals)
        console.say(f"added `signals:` to {self.robot}")
        if imported.signals.get("t", {}).get("unit") == TIMESTAMP:
            (column,) = imported.signals["t"]["columns"]
            console.say(
                f"with it the timestamps of {column} are read as seconds from the first; where they are irregular, the verbs that read "
                "logs resample them to a uniform time step, and say so"
            )

    def _following(self, imported: ImportedFile) -> str:
        if self.out is None:
            return f"if the columns are right, the same with --out {'log' if imported.kind == 'log' else 'poses'}.csv, else with --map"
        if imported.kind == "log":
            return f"flexcal identify dynamics {quoted(self.robot)} {quoted(self.out)}"
        if imported.kind == "joints":
            return f"flexcal design poses {quoted(self.robot)} --from {quoted(self.out)} --out plan.yaml"
        from flexcal.jobs.inputs import stored_estimates

        calibrate, verify = (f"flexcal {verb} {self.robot} {self.out}" for verb in ("calibrate", "verify"))
        if "x" not in imported.columns:
            return calibrate
        if stored_estimates(imported.model, None).is_file():
            return (
                f"{verify}, if these poses are outside the calibration; or, to calibrate again, {calibrate}"
            )
        return f"{calibrate}; or, if they are verification poses, {verify}"
