"""cell.yaml: every option that is accepted changes what the cell does, and a mistake is one sentence with its line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.data.plans import PosePlan
from flexcal.files.formats import read_yaml
from flexcal.jobs.experiments import frequency_plan
from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.model.robot.measuring_config import ArmSensorConfig
from flexcal.virtual_cell import CellConfig, FrictionConfig, MismatchConfig, VirtualCell, draw_truth

pytest.importorskip("mujoco")

BASE = CellConfig(
    friction=FrictionConfig(stribeck=0.3),
    mismatch=MismatchConfig(hysteresis=1e-5, temperature_drift=1e-4),
)
_AXIS = np.array([1.0, 0.0, 0.0])
_DECLARED = ArmSensorConfig(frame="flange", xyz=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0))
SENSORS = {
    name: ArmSensor(name, 5, 0.1 * _AXIS, _AXIS, order == 2, order, _DECLARED)
    for order, name in enumerate(("probe", "beam", "hand"))
}
"""One of each kind: displacement, velocity, acceleration."""


def options(config: Any, above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The names that lead to every value."""
    for field in fields(config):
        value = getattr(config, field.name)
        yield from options(value, (*above, field.name)) if is_dataclass(value) else [(*above, field.name)]


def changed(config: Any, path: tuple[str, ...]) -> Any:
    """The same with another value there."""
    value = getattr(config, path[0])
    if len(path) > 1:
        other = changed(value, path[1:])
    elif isinstance(value, bool):
        other = not value
    elif isinstance(value, tuple):
        other = tuple(1.5 * v for v in value)
    elif isinstance(value, str):
        other = {"linear": "warming"}[value]
    else:
        other = 2 * value if value else {"elastic_wrist": 1e5, "cubic_stiffness": 0.1}.get(path[0], 1e-3)
    return replace(config, **{path[0]: other})


def outcome(model: RobotModel, config: CellConfig) -> bytes:
    """All that the cell lets out of a truth that it draws."""
    truth = draw_truth(model, config.spread, np.random.default_rng(0))
    model = replace(model, sensors=SENSORS)
    cell = VirtualCell(model.with_values(truth), config, 1, controller_model=model, threads=1)
    file = model.path.parent / "frequency_poses.csv"
    short = {"base_frequency_hz": 4.0, "lines": np.array([1, 3, 5]), "amplitude": np.full((3, 3), 20.0)}
    short |= {"periods": 1, "settle_periods": 0, "realisations": 1, "signs": False}
    plan = replace(frequency_plan(model, file, "default", 3), reference_frequency_hz=2.0, **short)
    plan = replace(plan, poses=plan.poses[:1])
    recording = next(iter(cell.record(plan)))
    poses = cell.measure(PosePlan(q=plan.poses + np.array([[0.0], [0.3], [-0.4]]), seed=2))
    seen = [
        recording.q,
        recording.torque,
        recording.arm,
        recording.sensed,
        poses.q,
        poses.position,
        poses.sigma,
        poses.torque,
    ]
    return repr(truth).encode() + b"".join(x.tobytes() for x in (*seen, poses.temperature) if x is not None)


@pytest.fixture(scope="module")
def usual(tx90l: RobotModel) -> bytes:
    return outcome(tx90l, BASE)


@pytest.mark.parametrize("path", list(options(BASE)), ids=".".join)
def test_no_option_is_ignored(tx90l: RobotModel, usual: bytes, path: tuple[str, ...]) -> None:
    assert outcome(tx90l, changed(BASE, path)) != usual


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("controller: {substeps: 1,\n  kp: [3000]}", ["E-YAML-001", "line 2", "kp", "known are substeps"]),
        ("controller: {substeps: 1,\n  rate_hz: 4000}", ["E-YAML-001", "line 2", "rate_hz"]),
        ("controller: {substeps: 0}", ["E-CELL-018", "line 1"]),
        ("sensors: {torque_noise: -1}", ["E-CELL-016", "line 1", "torque_noise"]),
        ("friction: {coulomb_velocity: 0}", ["E-CELL-019", "line 1"]),
        ("spread: {backlash: [2e-5, 1e-5]}", ["E-CELL-020", "line 1"]),
        ("sensors: {encoder_counts: 2.5}", ["E-YAML-028", "line 1"]),
        (
            "sensors: {torque_noise: 1,\n  tracker_noise_m: 0.03}",
            ["E-CELL-035", "line 2", "in m: write 3e-05 for 0.03 mm"],
        ),
        ("spread: {backlash: [0.0, 0.04]}", ["E-CELL-035", "line 1", "0.04 rad", "4e-05 for 0.04 mrad"]),
        ("mismatch: {repeatability: 35}", ["E-CELL-035", "line 1", "35 m,", "3.5e-05 for 35 µm"]),
        ("mismatch: {link_growth: 12}", ["E-CELL-035", "line 1", "1.2e-05 for 12 µm/m/K"]),
        ("mismatch: {hysteresis: .nan}", ["E-YAML-026", "line 1"]),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path: Path, text: str, refusal: list[str]) -> None:
    (tmp_path / "cell.yaml").write_text(text + "\n")
    code, *names = refusal
    with refused(code, "cell.yaml", *names):
        read_yaml(tmp_path / "cell.yaml", CellConfig)


def test_a_camera_may_measure_to_a_millimetre(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text("sensors: {tracker_noise_m: 1.0e-3}\n")
    assert read_yaml(tmp_path / "cell.yaml", CellConfig).sensors.tracker_noise_m == 1e-3
