"""Calibrated robot, from robot.yaml and stored estimates."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from flexcal.calibration.fit import probable_robots, with_calibrated_points
from flexcal.calibration.kinds import is_inclinometer
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import BLOCKS, Block, block_sha256, read_estimates, read_yaml_file
from flexcal.jobs.result_files import ESTIMATES
from flexcal.model.robot import (
    DECLARED,
    READINGS,
    TARGETS,
    TARGETS_BETWEEN,
    Posterior,
    RobotModel,
    declared_sha256,
    with_blocks,
)
from flexcal.printable import quoted

REFUSED = "refused"
"""Provenance key of a calibration whose own verdict was no: why."""


@dataclass(frozen=True, eq=False)
class CalibratedRobot:
    """Calibrated robot together with its nominal one.

    Attributes
    ----------
    nominal : RobotModel
        The robot as declared.
    model : RobotModel
        `nominal` with the `blocks` of its estimates.
    blocks : mapping of Estimate
        Estimates by block.
    stored : Path or None
        The file that these were read from.

    Examples
    --------
    >>> from flexcal import RobotModel, calibrate, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> robot.measured
    ('smr',)
    """

    nominal: RobotModel
    model: RobotModel
    blocks: Mapping[Block, Estimate]
    stored: Path | None = None

    @classmethod
    def from_yaml(cls, path: str | Path, estimates: str | Path | None = None) -> CalibratedRobot:
        """Read a robot and its estimates.

        Parameters
        ----------
        path : str or Path
            The file robot.yaml.
        estimates : str or Path, optional
            File, or folder with an estimates.yaml, in place of the estimates.yaml beside robot.yaml.

        Returns
        -------
        CalibratedRobot
            The robot with these estimates.

        Raises
        ------
        FlexcalError
            As reading does.
        InputError
            Where there is no calibration.
        """
        nominal = RobotModel.from_yaml(path, estimates=False)
        stored = stored_estimates(nominal, None if estimates is None else Path(estimates))
        if not stored.exists():
            raise InputError(
                "E-RUN-055",
                f"{stored} does not exist, so there is no calibration; run 'flexcal calibrate {quoted(nominal.path)} POSES…' first.",
            )
        blocks = read_estimates(stored)
        if "calibration" not in blocks:
            raise InputError(
                "E-RUN-056",
                f"{stored}: there is no calibration in it; run 'flexcal calibrate {quoted(path)} POSES…' first.",
            )
        return cls(nominal, with_blocks(nominal, blocks, stored), blocks, stored)

    @property
    def targets(self) -> tuple[str, ...]:
        """Points measured in the calibration, and inclinometers read."""
        return measured_points(self.nominal, self.blocks)

    @property
    def measured(self) -> tuple[str, ...]:
        """Points measured in the calibration."""
        return tuple(name for name in self.targets if not is_inclinometer(self.nominal, name))

    @property
    def only_sockets(self) -> bool:
        """Whether a ball in sockets was all that the calibration measured, so that the scatter of the robot is that of contacts."""
        return self.blocks["calibration"].provenance.get(READINGS) == "sockets"

    @property
    def refused(self) -> str:
        """Why the verdict on the calibration itself was no; empty where it was not."""
        calibration = self.blocks.get("calibration")
        return "" if calibration is None else calibration.provenance.get(REFUSED, "")

    @property
    def probable(self) -> RobotModel:
        """Robot with the most probable values along the directions that the measured points do not determine; for all other frames."""
        return self._most_probable[0]

    @property
    def unseen(self) -> RobotModel:
        """The same robot with only what the measured points leave open in its posterior."""
        return self._most_probable[1]

    @cached_property
    def _most_probable(self) -> tuple[RobotModel, RobotModel]:
        return probable_robots(self.model, self.targets)

    @cached_property
    def with_points(self) -> RobotModel:
        """Nominal robot with the measured points at their calibrated positions on the tool."""
        return with_calibrated_points(self.nominal, self.probable, self.measured)


def refused_remark(calibrated: CalibratedRobot) -> tuple[str, ...]:
    """Remark on a calibration whose own verdict was no; none for others."""
    if not calibrated.refused:
        return ()
    return (
        f"'flexcal calibrate' did not trust this calibration, because {calibrated.refused}: do not use it on the robot before that is "
        "mended",
    )


def unmeasured_targets_remark(calibrated: CalibratedRobot, targets: Iterable[str]) -> tuple[str, ...]:
    """Remark on `targets` that no calibration pose measured; none if all were."""
    if not calibrated.measured:
        return unmeasured_lengths_remark(calibrated)
    named = [name for name in targets if name not in calibrated.measured]
    if not named:
        return ()
    return (
        f"no calibration pose measured {' and '.join(named)}: its position on the tool is the declared one, whose error is not part of the "
        "predicted uncertainty",
    )


def unmeasured_lengths_remark(calibrated: CalibratedRobot) -> tuple[str, ...]:
    """Remark on positions of a robot that was calibrated with inclinometers alone; none for others."""
    if calibrated.measured or not calibrated.targets:
        return ()
    return (
        "the calibration read inclinometers alone: lengths, base and tool are the nominal ones, and positions are as wrong as these; "
        "'flexcal map' predicts by how much for typical tolerances of 0.3 mm and 0.5 mrad",
    )


_USED: Mapping[Block, tuple[Block, ...]] = {
    "stiffness": ("dynamics",),
    "calibration": ("dynamics", "stiffness", "payload"),
}
"""Blocks that an identification starts from, so that its result is of another robot where they change."""


def outdated_remarks(calibrated: CalibratedRobot) -> tuple[str, ...]:
    """Remarks on blocks that were computed from another robot or other blocks than are there now; none for others."""
    remarks = []
    for block, used in _USED.items():
        if calibrated.stored is None or block not in calibrated.blocks:
            continue
        origin = calibrated.blocks[block].provenance
        changed = [f"another block '{name}'" for name in used if _is_changed(calibrated, origin, name)]
        own = calibrated.targets if block == "calibration" else ()
        # files of older versions have the digest of all points
        now = {declared_sha256(calibrated.nominal, points) for points in (own, calibrated.nominal.points)}
        if origin.get(DECLARED, "") not in ("", *now):
            changed.insert(0, "other numbers in robot.yaml or its URDF")
        if changed:
            again = "calibrate" if block == "calibration" else f"identify {block}"
            remarks.append(
                f"the block '{block}' was computed from {' and '.join(changed)} than now, so that it does not belong to this robot: run "
                f"'flexcal {again}' again"
            )
    return tuple(remarks)


def _is_changed(calibrated: CalibratedRobot, origin: Mapping[str, str], name: Block) -> bool:
    if "program" not in origin:  # not made by a verb
        return False
    now = block_sha256(calibrated.stored, name) if calibrated.stored and name in calibrated.blocks else None
    return origin.get(f"block.{name}") != now


def use_remarks(calibrated: CalibratedRobot) -> tuple[str, ...]:
    """Remarks on the use of a calibration that was not trusted, is outdated, or read inclinometers alone; none for others."""
    return (
        *refused_remark(calibrated),
        *outdated_remarks(calibrated),
        *unmeasured_lengths_remark(calibrated),
    )


def measured_points(nominal: RobotModel, blocks: Mapping[Block, Estimate]) -> tuple[str, ...]:
    """Points measured in the calibration among `blocks`; none without one."""
    if "calibration" not in blocks:
        return ()
    estimate = blocks["calibration"]
    said = estimate.provenance.get(TARGETS)
    if said is not None:
        return tuple(name for name in said.split(TARGETS_BETWEEN) if name in nominal.points)
    further = (name for name in nominal.points if f"point.{name}.x" in estimate.parameters)
    return tuple(dict.fromkeys([*list(nominal.points)[:1], *further]))


def probable_model(path: Path, estimates: Path | None = None) -> tuple[RobotModel, Posterior | None]:
    """The robot of a robot.yaml with its estimates, for frames that were not measured: a calibrated one as in `CalibratedRobot.probable`.

    With it the part of its posterior that the measured points left open; None without a calibration of points. `estimates` are as in
    `stored_estimates`; without any, the nominal robot. Raises `FlexcalError` as reading does.
    """
    nominal = RobotModel.from_yaml(path, estimates=False)
    stored = stored_estimates(nominal, estimates)
    if estimates is None and not stored.exists():
        return nominal, None
    blocks = read_estimates(stored)
    robot = CalibratedRobot(nominal, with_blocks(nominal, blocks, stored), blocks, stored)
    return (robot.probable, robot.unseen.posterior) if robot.measured else (robot.probable, None)


def stored_estimates(nominal: RobotModel, estimates: Path | None) -> Path:
    """Path of a robot's estimates.yaml: the named file or that in the named folder, else that beside robot.yaml.

    Raises `InputError` where what is named is another kind of file, or a folder without one.
    """
    if estimates is None:
        return nominal.estimates_file
    expected = f"--estimates takes the {ESTIMATES} that 'flexcal calibrate' or another identification wrote, or the folder with it"
    if estimates.is_dir():
        if not (estimates / ESTIMATES).is_file():
            raise InputError("E-RUN-052", f"{estimates} holds no {ESTIMATES}; {expected}.")
        return estimates / ESTIMATES
    if estimates.suffix not in ("", ".yaml", ".yml"):
        raise InputError("E-RUN-053", f"{estimates} is no {ESTIMATES}; {expected}.")
    if estimates.is_file():
        blocks = read_yaml_file(estimates).data
        if not isinstance(blocks, dict) or not set(BLOCKS) & set(blocks):
            raise InputError("E-RUN-054", f"{estimates} holds no estimates; {expected}.")
    return estimates


def is_station_identified(model: RobotModel, station: str) -> bool:
    """Whether the calibration estimated the placement of this station."""
    return any(name.startswith(f"station.{station}.") for name in model.posterior.parameters.names)
