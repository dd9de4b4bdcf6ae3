"""Torques of the motors of a robot.yaml with its estimates."""

from __future__ import annotations

from pathlib import Path

from flexcal.calibration.fit import probable_robot
from flexcal.dynamics.torque_model import TorqueModel
from flexcal.files.formats import read_estimates
from flexcal.jobs.inputs import measured_points, stored_estimates
from flexcal.model.robot import RobotModel, with_blocks


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
        As reading does, with file and line.

    Examples
    --------
    >>> from flexcal import read_torque_model
    >>> read_torque_model("examples/tx40/robot.yaml").identified
    False
    """
    nominal = RobotModel.from_yaml(path, estimates=False)
    stored = stored_estimates(nominal, None if estimates is None else Path(estimates))
    blocks = read_estimates(stored) if stored.exists() or estimates is not None else {}
    model, measured = with_blocks(nominal, blocks, stored), measured_points(nominal, blocks)
    return TorqueModel.of_blocks(probable_robot(model, measured) if measured else model, blocks)
