"""Actuators in MJCF and as JSON: the file moves as the arm that another program simulates."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import assert_refusal
from servo_arm import NAMES, TRUTH, Servo, arm, simulate

from flexcal.cli.main import main
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.export import OF_ERROR, Actuators, actuator_name, export_mjcf
from flexcal.files.formats import write_estimates

mujoco = pytest.importorskip("mujoco")
RATE = 200.0


def store(folder: Path, servo: Servo) -> None:
    """estimates.yaml with the actuators of an arm."""
    names = {
        actuator_name(joint, key): v[i] for key, v in servo.values().items() for i, joint in enumerate(NAMES)
    }
    parameters = Parameters(Parameter(name, "", float(value)) for name, value in names.items())
    size = len(parameters)
    estimate = Estimate(
        parameters, 1e-6 * np.eye(size), size, (), (True,) * size, 1.0, 1.0, 100, "converged", "", 3,
        provenance={"option.damping": OF_ERROR if servo.rate else "velocity"},
    )  # fmt: skip
    write_estimates(folder / "estimates.yaml", "actuators", estimate)


def steps() -> np.ndarray:
    """A step of every joint (N, 2), each at its time."""
    time = np.arange(300) / RATE
    return np.stack([0.3 + 0.2 * (time > 0.2), 0.4 - 0.3 * (time > 0.6)], axis=1)


def response(path: Path, commands: np.ndarray, velocity: bool) -> np.ndarray:
    """Positions (N, 2) of the file under the commands, interpolated."""
    loaded = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(loaded)
    data.qpos[:] = commands[0]
    many = round(1 / RATE / loaded.opt.timestep)
    time, reached = np.arange(len(commands)) / RATE, [data.qpos.copy()]
    drives = [loaded.actuator(name).id for name in NAMES]
    for i, drive in enumerate(drives):
        if loaded.actuator_history[drive, 0]:
            mujoco.mj_initCtrlHistory(
                loaded, data, drive, None, np.full(loaded.actuator_history[drive, 0], commands[0, i])
            )
    for k in range((len(commands) - 1) * many):
        for i, drive in enumerate(drives):
            at = k * loaded.opt.timestep
            data.ctrl[drive] = np.interp(at, time, commands[:, i])
            if velocity:
                after = np.interp(at + 1e-4, time, commands[:, i])
                data.ctrl[drive + 1] = (after - data.ctrl[drive]) / 1e-4
        mujoco.mj_step(loaded, data)
        if (k + 1) % many == 0:
            reached.append(data.qpos.copy())
    return np.array(reached)


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_the_file_answers_steps_as_the_arm_does(tmp_path: Path, rate: float) -> None:
    servo = Servo(**TRUTH.values(), rate=rate)
    arm(tmp_path)
    store(tmp_path, servo)
    out = tmp_path / "arm.xml"
    assert main(["export", "mjcf", str(tmp_path / "robot.yaml"), "--out", str(out)]) == 0
    commands = steps()
    if rate:
        time = np.arange(len(commands)) / RATE
        commands = np.stack([0.5 - 0.2 * np.cos(4 * time), 0.2 + 0.2 * np.cos(6 * time)], axis=1)
    true = simulate(servo, commands[None], RATE, step=2.5e-4)[0]
    own = response(out, commands, bool(rate))
    missed = np.sqrt(np.mean((own - true) ** 2))
    assert missed < 0.01 * np.sqrt(np.mean((commands - true) ** 2))
    # gains alone, as of a data sheet: without delay, friction and armature
    naive = Actuators(
        *(getattr(TRUTH, key) * (key in ("stiffness", "damping")) for key in Actuators.KEYS),
        follows_velocity=bool(rate),
    )
    from flexcal.export import render_mjcf
    from flexcal.model.robot import RobotModel

    model = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    (tmp_path / "naive.xml").write_text(render_mjcf(model, naive).text)
    assert missed < 0.1 * np.sqrt(
        np.mean((response(tmp_path / "naive.xml", commands, bool(rate)) - true) ** 2)
    )


def test_isaac_has_every_number_in_its_place(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    arm(tmp_path)
    out, robot = tmp_path / "actuators.json", str(tmp_path / "robot.yaml")
    assert main(["export", "isaac", robot, "--out", str(out)]) == 2
    assert_refusal(capsys.readouterr().err, "E-RUN-107", "flexcal identify actuators")
    store(tmp_path, Servo(**{**TRUTH.values(), "delay": np.array([0.012, 0.021])}))
    assert main(["export", "isaac", robot, "--out", str(out), "--time-step", "0"]) == 2
    assert_refusal(capsys.readouterr().err, "E-CLI-045", "--time-step")
    assert main(["export", "isaac", robot, "--out", str(out), "--time-step", "0.005"]) == 0
    assert "actuators only" in capsys.readouterr().out
    written = json.loads(out.read_text())
    assert written["delay_s"] == {"shoulder": 0.012, "elbow": 0.021}
    groups = written["isaac_lab"]["actuators"]
    assert {name: group["joint_names_expr"] for name, group in groups.items()} == {
        "delay_2": ["shoulder"],
        "delay_4": ["elbow"],
    }
    assert groups["delay_2"] == {
        "joint_names_expr": ["shoulder"],
        "effort_limit": {"shoulder": 400.0},
        "stiffness": {"shoulder": 900.0},
        "damping": {"shoulder": 60.0},
        "armature": {"shoulder": 0.8},
        "friction": {"shoulder": 4.0},
        "dynamic_friction": {"shoulder": 4.0},
        "viscous_friction": {"shoulder": 6.0},
        "min_delay": 2,
        "max_delay": 2,
    }
    assert written["pace"]["parameters"] == [0.8, 0.25, 6.0, 2.0, 4.0, 1.5, 0.0, 0.0, 3]


def test_a_robot_without_actuators_is_driven_by_torques(tmp_path: Path) -> None:
    export_mjcf(arm(tmp_path), tmp_path / "arm.xml")
    loaded = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    assert not loaded.actuator_biasprm.any()
