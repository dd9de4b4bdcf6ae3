"""Measured currents of a UR10e that moves from point to point, as what one exciting trajectory taught predicts them."""

from pathlib import Path

import numpy as np
import pytest
from ur10e_logs import COLUMNS, FOLDER, at_hand, log, published_gains

from flexcal.dynamics.signals import JointLog, Motion
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.model.robot import RobotModel

pytestmark = at_hand


@pytest.mark.parametrize(("friction", "most"), [("classic", 0.0625), ("auto", 0.052)])
def test_a_motion_of_another_day(tmp_path: Path, friction: str, most: float) -> None:
    """‖Y - Wχ‖ / ‖Y‖ of the currents as they were measured, times the published gains; the published parameters leave 6.61 % of them."""
    gains = published_gains()
    currents = f"{{columns: [{', '.join(COLUMNS[7:])}], unit: A, gain: {gains.tolist()}}}"
    (tmp_path / "robot.yaml").write_text(
        f"robot: {FOLDER.absolute() / 'ur10e.urdf'}\ndynamics: {{friction: {friction}}}\nsignals: {{tau: {currents}}}\n"
    )
    log("ur-20_02_10-30sec_12harm.csv", slice(634, 3510)).write_csv(tmp_path / "exciting.csv")
    fresh = log("ur-20_01_17-ptp_10_points.csv", slice(699, 4200))
    fresh.write_csv(tmp_path / "fresh.csv")
    found = identify_robot_dynamics(tmp_path / "robot.yaml", [tmp_path / "exciting.csv"])
    observation = found.train.observation
    x = found.estimate.parameters.coordinates()

    model = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    read = JointLog.read(tmp_path / "fresh.csv", model, found.preprocessing.cutoff_hz, tmp_path)
    motion = Motion.joined(read.blocks())
    columns = zip(observation.columns(motion), observation.column_indices, strict=True)
    time = fresh["t"].to_numpy()
    inside = (time >= motion.time[0]) & (time <= motion.time[-1])
    assert inside.mean() > 0.98
    measured = fresh.select(COLUMNS[7:]).to_numpy()[inside] * gains
    predicted = [np.interp(time[inside], motion.time, x[members] @ own) for own, members in columns]
    assert np.linalg.norm(measured - np.transpose(predicted)) < most * np.linalg.norm(measured)
