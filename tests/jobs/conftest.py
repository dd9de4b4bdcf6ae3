"""The virtual TX90L on exciting trajectories, its elastic joints measured on the arm side too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from flexcal.data.recordings import write_recording
from flexcal.jobs.experiments import TrajectoryRequest
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, SensorConfig, VirtualCell

ArmSideLogs = Callable[..., tuple[Path, list[Path]]]


@pytest.fixture(scope="session")
def arm_side_logs(examples: Path) -> ArmSideLogs:
    """arm_side_logs(folder, truth, seed, count, share): robot.yaml, and the logs of so many trajectories of 5 s that do not repeat.

    `share` of velocities and torques is used.
    """

    def make(
        folder: Path, truth: Mapping[str, float], seed: int, count: int, share: float = 0.8
    ) -> tuple[Path, list[Path]]:
        text = (examples / "tx90l" / "robot.yaml").read_text()
        lines = [line for line in text.splitlines() if not line.startswith(("payload:", "dynamics:"))]
        lines.append("dynamics: {friction: classic, decimation: 200, tau: held}")
        robot = folder / "robot.yaml"
        robot.write_text("\n".join(lines) + "\n")
        (folder / "tx90l.urdf").write_text((examples / "tx90l" / "tx90l.urdf").read_text())
        nominal = RobotModel.from_yaml(robot, estimates=False)
        plan = TrajectoryRequest(count=count, seed=seed, share=share, searches=1).optimise(nominal)[0].plan
        plan = replace(plan, periods=1, settle_periods=0)
        config = CellConfig(sensors=SensorConfig(arm_encoders=True))
        known = {name: value for name, value in truth.items() if not name.startswith("payload.")}
        cell = VirtualCell(nominal.with_values(known), config, seed, controller_model=nominal)
        logs = []
        for number, recording in enumerate(cell.record(plan), start=1):
            logs.append(folder / f"log_{number}.parquet")
            write_recording(logs[-1], recording)
        return robot, logs

    return make
