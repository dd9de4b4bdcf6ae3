"""`flexcal recheck`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Estimates,
    Json,
    MaybeCount,
    MaybePath,
    MaybeText,
    Paths,
    Robot,
    Temperature,
    any_number,
    file_argument,
    require_robot,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import estimates_option, import_command, measure_command
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted


@dataclass(frozen=True)
class Recheck:
    """Say by about ten measured poses whether a robot is as calibrated: or tool bumped, a joint shifted by so much, thermal growth,
    another payload, instrument moved, or recalibrate; one false alarm in a hundred visits.

    The visits are kept in a folder: the first that is as calibrated is the reference for those after it at the same poses, and cumulative
    sums over all of them find slow drifts. With --plan, the poses of such visits are chosen instead, with the shifts that they will find.
    """

    robot: Robot
    poses: Annotated[
        Positional[Paths],
        file_argument("POSES...", "files of measured poses (CSV or Parquet) of one visit; none with --plan"),
    ] = ()
    plan: Annotated[MaybeCount, arg(metavar="N", help_behavior_hint="(default: none)"), Between(1, 1000)] = (
        None
    )
    """Choose N poses for the reference visit and those after it, and write plan.yaml."""
    estimates: Estimates = None
    refit: Annotated[
        tuple,
        any_number("station", choices=("station",)),
        arg(metavar="station", help_behavior_hint="(default: where evident)"),
    ] = ()
    """station: the instrument stands elsewhere than at the calibration or the reference visit; its place is fitted to the poses."""
    reference: bool = False
    """This visit is the reference for later ones, in place of an earlier one; measure every pose three times in it."""
    temperature: Temperature = None
    date: Annotated[MaybeText, arg(metavar="DATE", help_behavior_hint="(default: today)")] = None
    """Date of the visit, like 2026-03-31."""
    visits: Annotated[
        MaybePath, arg(name="out", metavar="DIR", help_behavior_hint="(default: recheck beside robot.yaml)")
    ] = None
    """Folder of the visits: visits.json, and report.html and results.json of the last one."""
    json: Json = False

    @property
    def out(self) -> Path:
        """Folder of the visits."""
        return self.robot.parent / "recheck" if self.visits is None else self.visits

    @property
    def leaves(self) -> tuple[str, ...]:
        """Files that a run writes."""
        return ("plan.yaml",) if self.plan is not None else ("visits.json", "results.json", "report.html")

    def run(self) -> None:
        """Judge the visit, and print what it says; or plan one."""
        console = Console(self.json)
        if self.plan is not None:
            self._plan(console, self.plan)
            return
        from flexcal.jobs.recheck import recheck_robot
        from flexcal.report.layout import counted

        require_robot_and_files(self.robot, self.poses, "POSES")
        with console.progress() as progress:
            checked = recheck_robot(
                self.robot,
                self.poses,
                self.out,
                estimates=self.estimates,
                refit="station" in self.refit,
                reference=self.reference,
                temperature=self.temperature,
                day=self.date,
                command=command_line(),
                progress=progress,
            )
        console.say(checked.headline)
        console.say(checked.power_sentence)
        for remark in checked.remarks:
            console.say(remark)
        console.say(
            f"wrote {self.out / 'visits.json'}: {counted(checked.kept, 'visit')} since this calibration"
        )
        console.say(f"wrote {self.out / 'report.html'}")
        document = checked.document()
        where = estimates_option(self.estimates)
        kept = where if self.visits is None else f"{where} --out {quoted(self.visits)}"
        again = f"flexcal recheck {quoted(self.robot)} NEXT_VISIT.csv{kept}"
        after = {
            "as_calibrated": f"{again}, at the same poses",
            "noisier_readings": f"check the instrument, measure the visit again, and {again}",
            "readings_drift": f"let instrument and robot settle, measure the visit again, and {again}",
            "wrong_reading": f"mend what is named, or measure it again, and {again}",
            "instrument_moved": f"while the instrument stands there, {again} --refit station, at the same poses",
            "recalibrate": f"flexcal calibrate {quoted(self.robot)} POSES… anew, unless the visit was measured or written wrongly",
        }
        console.finish(
            document,
            after.get(
                checked.verdict,
                f"mend what is named where it can be, and {again}; or flexcal calibrate {quoted(self.robot)} POSES… anew",
            ),
        )

    def _plan(self, console: Console, count: int) -> None:
        from flexcal.calibration.recheck import FALSE_ALARM, VISIT_ALARM
        from flexcal.jobs.recheck import plan_visit

        require_robot(self.robot)
        if self.poses or self.reference or self.date is not None:
            raise InputError("E-RECHECK-010", "--plan goes with none of POSES, --reference and --date.")
        with console.progress() as progress:
            planned = plan_visit(
                self.robot,
                self.out,
                count,
                estimates=self.estimates,
                refit="station" in self.refit,
                command=command_line(),
                progress=progress,
            )
        where = estimates_option(self.estimates)
        kept = where if self.visits is None else f"{where} --out {quoted(self.visits)}"
        console.say(
            f"shifts of single joints that are found in 95 % of visits, at false alarms of {100 * FALSE_ALARM:g} % (of a visit alone "
            f"{100 * VISIT_ALARM:g} %):"
        )
        for line in planned.lines:
            console.say(line)
        console.say(f"wrote {planned.file}: {len(planned.plan)} poses")
        console.finish(
            planned.document(),
            f"{measure_command(planned.file, self.robot, 'visit')}{import_command(self.robot, 'visit.csv')}; the first time every "
            f"pose three times; then flexcal recheck {quoted(self.robot)} visit.csv{kept}, and again at every visit",
        )
