"""`flexcal calibrate`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Json,
    MaybePath,
    MaybeText,
    PoseFiles,
    Robot,
    Texts,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import estimates_option
from flexcal.cli.terminal.console import Console
from flexcal.files.transaction import read_text, write_text
from flexcal.printable import quoted
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.jobs.calibration import Calibration
    from flexcal.model.robot import RobotModel
    from flexcal.progress import Progress


def considered_lines(rows: Sequence[Mapping[str, Any]], fitted: Sequence[str]) -> list[str]:
    """One line a term of `term_selection` in results.json; compliances of single joints that were left stand in one line together.

    Of the `fitted` terms that of the transmission is in place of its waves, and is told as such.
    """
    from flexcal.calibration.error_model import TRANSMISSION

    lines, joints = [], []
    for row in rows:
        term = row["term"]
        if term is None:
            continue
        if not row["taken"] and "." in term:
            joints.append(term)
            continue
        lines.append(
            f"considered {term}: {'taken, because it' if row['taken'] else 'left, because'} {row['reason']}"
        )
    if joints:
        lines.append(
            f"considered for single joints and left, because left-out poses or the BIC do not support them: {', '.join(joints)}"
        )
    if TRANSMISSION in fitted and any(str(row["term"]).startswith(f"{TRANSMISSION}_") for row in rows):
        lines.append(
            "fitted in place of transmission_1 and so on, taken or left: transmission, random waves of every joint of fitted size"
        )
    return lines


@dataclass(frozen=True)
class Calibrate:
    """Calibrate the geometry of a robot from measured positions: joint offsets, misalignments, lengths, tool, backlash.

    Starts from robot.yaml and the results of 'identify stiffness', and writes estimates.yaml beside robot.yaml. Two fits are reported:
    a rigid one, and one with elasticity and the terms selected by cross-validation; the second is stored.
    """

    robot: Robot
    poses: PoseFiles
    terms: Annotated[
        Texts, arg(metavar="TERM...", help_behavior_hint="(default: as robot.yaml declares)")
    ] = ()
    """auto, or some of: kinematic (or offsets or lengths), backlash, gravity_compliance, lateral_compliance, transmission, ratio,
    thermal, thermal_links, thermal_drift, thermal_stations; JOINT.gravity_compliance is that of one joint. auto: those that
    cross-validation supports, and transmission."""
    loss: Literal["auto", "squares", "huber", "cauchy"] = "auto"
    """Loss function; cauchy is robust and lists outliers; auto uses it where there are outliers."""
    secant_scale: Annotated[float, arg(metavar="STD"), Between(0, 100)] = 0.0
    """Relative 1σ of the ratio of a drive's secant stiffness under gravity to its stiffness in the frequency response; 0.1 is usual."""
    elasticity: Literal["reestimated", "marginalised"] = "reestimated"
    """Treatment of the uncertainty of stiffness and inertia; both give the same geometry to first order."""
    hold_out: Annotated[MaybeText, arg(metavar="COLUMN", help_behavior_hint="")] = None
    """Column of POSES: the measurements with each of its values are left out of a further calibration in turn, and compared with it."""
    prior: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """Prior from other robots of the model, as 'flexcal fleet --prior' writes it: fewer poses are then enough. Its stiffness is taken where
    none was identified of this robot. By default tolerances of manufacture are the prior where the poses do not determine all errors; none:
    no prior, and what they do not determine stays nominal (Neubauer et al. 2015)."""
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: beside robot.yaml)")] = None
    """Folder for report.html, results.json, points.csv and estimates.yaml (then not beside robot.yaml); without it there is no report."""
    write_point: bool = False
    """Write the calibrated positions of the measured points to robot.yaml, in place of the declared ones, and calibrate with them."""
    json: Json = False

    def run(self) -> None:
        """Calibrate, and print identifiability, errors and remarks."""
        from flexcal.calibration.error_model import TRANSMISSION
        from flexcal.calibration.fit import KNOWN_POINT_STD
        from flexcal.cli.tables.results import (
            dropped_table,
            error_table,
            inclination_table,
            orientation_table,
            uncalibrated_rows,
            weak_table,
        )

        require_robot_and_files(self.robot, self.poses, "POSES")
        console = Console(self.json)
        with console.progress() as progress:
            calibration = self._calibrated(self.terms, progress)
            known = all(point["std_m"] <= KNOWN_POINT_STD for point in calibration.found_points.values())
            write = self.write_point and known and not calibration.is_implausible
            told = point_lines(calibration.selected.model, calibration.found_points) if write else []
            if write:
                calibration = self._with_points_written(calibration, progress)
        document = calibration.document()
        seen = document["identifiability"]
        if seen["dropped"]:
            console.show(dropped_table(seen))
        console.show(weak_table(seen["weak_directions"]))
        if calibration.selected.terms != calibration.rigid.terms:
            dropped = [d["name"] for d in seen["selected"]["dropped"]]
            further = [name for name in dropped if name not in calibration.rigid.identifiability.names]
            lost = f"; not separately identifiable: {', '.join(further)}" if further else ""
            console.say(
                f"with all terms: {seen['selected']['rank']} of {seen['selected']['parameters']} parameters{lost}"
            )
        for line in considered_lines(document["term_selection"], calibration.selected.terms):
            console.say(line)
        errors, poses = document["calibration"], calibration.selected.poses
        located, held = poses.located, bool(poses.in_socket.all())
        named = {TRANSMISSION: "random transmission"}
        terms = ("elastic, " if calibration.selected.model.elastic else "") + " + ".join(
            named.get(term, term) for term in calibration.selected.terms
        )
        labels = {"rigid": "rigid", "selected": f"selected: {terms}"}
        rows = uncalibrated_rows(document, held=held) | {label: errors[key] for key, label in labels.items()}
        rows |= {f"  of its {kind}": own for kind, own in errors["by_kind"].items()}
        read = "distance to the measured points" if located.all() else "difference from what was measured"
        read = "distance of the ball from its socket" if held else read
        if len(calibration.selected.poses.pointed):
            console.show(error_table(read, rows, document["variances"]["robot_mm"]))
        if document["inclination"] is not None:
            console.show(inclination_table(document["inclination"]))
        if document["orientation"] is not None:
            console.show(orientation_table(document["orientation"]))
        if calibration.held_out is not None:
            console.say(held_out_line(calibration.held_out.document()))
        for remark in document["remarks"]:
            console.say(remark)
        if write:
            for line in told:
                console.say(f"{line}: written to {self.robot}, and calibrated with it")
        else:
            known = all(point["std_m"] <= KNOWN_POINT_STD for point in document["points"].values())
            lines = (
                []
                if calibration.is_implausible
                else point_lines(calibration.selected.model, document["points"])
            )
            for line in lines:
                console.say(f"{line}; --write-point writes it to {self.robot}" if known else line)
        console.say(calibration.trust.sentence)
        where = estimates_option(self.out)
        console.say(f"wrote {calibration.estimates}")
        if self.out is not None:
            console.say(f"wrote {self.out / 'report.html'}")
        following = (
            f"correct the data or {self.robot}, and calibrate again; "
            f"flexcal import {quoted(self.robot)} {quoted(self.poses[0])} looks for the error"
            if calibration.is_implausible
            else f"flexcal verify {quoted(self.robot)} OTHER_POSES…{where}, on poses outside this fit "
            "(flexcal design poses --random plans some)"
            if located.any()
            else f"{command_line()} --hold-out fixture, for errors at places of the fixture outside the fit"
            if self.hold_out is None and len(poses.fixtures) > 1
            else f"{command_line()} --hold-out COLUMN, where a column tells recordings apart, for errors outside the fit"
            if self.hold_out is None
            else f"flexcal export urdf {quoted(self.robot)}{where}"
            if len(calibration.selected.poses.pointed)
            else f"flexcal export offsets {quoted(self.robot)}{where}, for the joint zeros that these readings tell"
        )
        if document["fleet"] is not None and document["fleet"]["conflict"]["contradicted"]:
            following = f"{command_line(without='--prior')}, on 30 poses or more, for a calibration from these measurements alone"
        if calibration.bearings is not None and calibration.bearings.contradicted:
            following = (
                f"write `bearings: {calibration.bearings.preferred}` in {self.robot}, and calibrate again"
            )
        console.finish(document, following)

    @property
    def _without_prior(self) -> bool:
        return self.prior is not None and str(self.prior) == "none"

    def _calibrated(self, terms: Sequence[str], progress: Progress) -> Calibration:
        from flexcal.jobs.calibration import calibrate_robot

        return calibrate_robot(
            self.robot,
            self.poses,
            terms=terms or None,
            loss=self.loss,
            secant_scale=self.secant_scale,
            elasticity=self.elasticity,
            hold_out=self.hold_out,
            prior=None if self._without_prior else self.prior,
            tolerances=not self._without_prior,
            out=self.out,
            command=command_line(),
            progress=progress,
        )

    def _with_points_written(self, calibration: Calibration, progress: Progress) -> Calibration:
        """Write the points to robot.yaml, and calibrate again: the estimates are relative to the declared points."""
        from flexcal.jobs.setup import write_point_position

        text = read_text(self.robot)
        try:
            for name, point in calibration.found_points.items():
                write_point_position(self.robot, name, point["found_xyz_m"])
            calibration = self._calibrated(calibration.selected.terms, progress)
            # takes its place after the estimates: where the process is killed between, the next run starts as this one did
            write_text(self.robot, read_text(self.robot))
            return calibration
        except BaseException:
            write_text(self.robot, text)
            raise


def held_out_line(held_out: Mapping[str, Any]) -> str:
    """A sentence on the errors at groups that were left out."""
    key, unit = ("mean_mm", "mm") if held_out["mean_mm"] is not None else ("mean_mrad", "mrad")
    listed = [f"{name} {group[key]:.3f}" for name, group in held_out["groups"].items()]
    more = f" and {len(listed) - _GROUPS} more" if len(listed) > _GROUPS else ""
    without = f" without the {held_out['outliers']} outliers" if held_out["outliers"] else ""
    line = f"left out by {held_out['by']}{without}, mean error {held_out[key]:.3f} {unit} ({', '.join(listed[:_GROUPS])}{more})"
    known = held_out["distance_mm"]
    return line if known is None else f"{line}; known distances are off by {known:.3f} mm"


_GROUPS = 20
"""Largest number of groups that a sentence lists."""
_FOUND_BESIDE = 5e-4
"""m: distance of a point from its declared position above which it is reported."""


def undetermined_point_remark(model: RobotModel, name: str, std: float) -> str:
    """A sentence on a measured point whose position on the tool the calibration does not determine."""
    from flexcal.model.kinematics import rotation_freedom

    freedom, where = rotation_freedom(model, name), f"(± {std / MILLIMETRE:.2g} mm)"
    if freedom < 2:
        turns, part = (
            ("turns its tool about one direction only", "along it")
            if freedom
            else ("does not turn its tool", "")
        )
        return (
            f"{model.name} {turns}, so points do not tell where {name} is on the tool {part}{' ' if part else ''}{where}: positions are "
            "those of this point, and another tool is as accurate as its distance from it is known"
        )
    return (
        f"these poses do not determine the position of the point {name} on the tool {where}: its orientation hardly "
        "changes. The calibration is valid at such orientations only; measure poses with other tool orientations, and calibrate again"
    )


def point_lines(model: RobotModel, points: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A line for each point whose calibrated position differs from the declared one; `points` as in the document."""
    from flexcal.calibration.fit import KNOWN_POINT_STD

    lines = []
    for name, point in points.items():
        off = math.dist(point["found_xyz_m"], point["declared_xyz_m"])
        if point["std_m"] > KNOWN_POINT_STD:
            lines.append(undetermined_point_remark(model, name, point["std_m"]))
        elif off > _FOUND_BESIDE:
            calibrated, declared = (
                ", ".join(f"{v:.5f}" for v in point[key]) for key in ("found_xyz_m", "declared_xyz_m")
            )
            lines.append(
                f"calibrated position of the point {name}: [{calibrated}] m in {point['frame']}, {off / MILLIMETRE:.2f} mm from the "
                f"declared [{declared}]"
            )
    return lines
