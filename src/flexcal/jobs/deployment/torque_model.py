"""Torques of the motors of a robot.yaml with its estimates."""

from __future__ import annotations

from pathlib import Path

from flexcal.dynamics.torque_model import TorqueModel
from flexcal.jobs.deployment.export import identified_robot


def read_torque_model(path: str | Path, estimates: str | Path | None = None) -> TorqueModel:
    """Torques of the motors of a robot, by what was identified of it.

    Parameters
    ----------
    path : str or Path
        The file robot.yaml.
    estimates : str or Path, optional
        File, or folder with an estimates.yaml, in place of the estimates.yaml beside robot.yaml. Where there is none, the torques are those
        of the URDF's links and the friction in robot.yaml.

    Returns
    -------
    TorqueModel
        Its torques.

    Raises
    ------
    InputError
        As reading does, with file and line, and where the named estimates do not exist.

    Examples
    --------
    >>> from flexcal import read_torque_model
    >>> read_torque_model("examples/tx40/robot.yaml").identified
    False
    """
    robot = identified_robot(Path(path), None if estimates is None else Path(estimates))
    return TorqueModel.of_blocks(robot.probable, robot.blocks)
