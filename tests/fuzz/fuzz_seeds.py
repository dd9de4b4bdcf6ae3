"""Valid files of a small arm of three joints, one of them elastic, which the cases break: made anew in every session, a few seconds."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
from fuzz_foreign import write_foreign
from numpy.lib.recfunctions import structured_to_unstructured

URDF = """<?xml version="1.0" encoding="UTF-8"?>
<robot name="arm">
  <link name="base"/>
  <link name="shoulder">
    <inertial>
      <origin xyz="0.01 0 0.1" rpy="0 0 0"/>
      <mass value="8"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.08"/>
    </inertial>
  </link>
  <link name="upper">
    <inertial>
      <origin xyz="0.2 0.01 0"/>
      <mass value="6"/>
      <inertia ixx="0.03" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <origin xyz="0.15 0 0.02"/>
      <mass value="4"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
    </inertial>
  </link>
  <link name="flange"/>
  <joint name="axis_1" type="revolute">
    <parent link="base"/>
    <child link="shoulder"/>
    <origin xyz="0 0 0.1" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-2.8" upper="2.8" effort="200" velocity="4"/>
  </joint>
  <joint name="axis_2" type="revolute">
    <parent link="shoulder"/>
    <child link="upper"/>
    <origin xyz="0.05 0 0.25" rpy="0 0 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="200" velocity="4"/>
  </joint>
  <joint name="axis_3" type="revolute">
    <parent link="upper"/>
    <child link="lower"/>
    <origin xyz="0.45 0 0" rpy="0.1 0 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2.4" upper="2.4" effort="100" velocity="6"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="lower"/>
    <child link="flange"/>
    <origin xyz="0.4 0 0" rpy="0 0 0"/>
  </joint>
</robot>
"""
ROBOT = """robot: arm.urdf
points:
  ball: {frame: flange, xyz: [0.05, 0.02, 0.06]}
payload: {frame: flange, mass: 2.0, com: [0.05, 0.0, 0.02], mass_std: 0.02}
gravity: [0, 0, -9.81]
prior: {mass: 0.07, com: 0.01, length: 0.001, angle: 0.002}
drives:
  rotor_inertia: [1.5, 1.5, 0.5]
  viscous: [9, 9, 3]
  coulomb: [5, 5, 2]
  ratio: [50, 50, 50]
elastic:
  - joint: axis_2
    drive: {stiffness: 2.0e4, damping: 10}
geometry: {terms: [kinematic]}
dynamics: {friction: classic, cutoff_hz: 5, decimation: 5}
stations:
  tracker: {xyz: [2.5, 0.3, 1.0]}
working_volume: {lower: [0.3, -0.3, 0.1], upper: [0.7, 0.3, 0.7]}
limits: {acceleration: [10, 10, 20]}
controller: {kp: [900, 900, 300], kd: [60, 60, 20], rate_hz: 500}
estimates: results/estimates.yaml
"""
CELL = """controller: {substeps: 2, rate_filter_hz: 200}
sensors: {encoder_counts: 262144, torque_noise: 0.1, tracker_noise_m: 15e-6, tracker_noise_per_m: 6e-6}
friction: {scale: 1.0, coulomb_velocity: 0.01}
spread: {mass: 0.02, com: 0.002, rotor_inertia: 0.02, length: 0.3e-3, angle: 0.5e-3, stiffness: 0.1}
mismatch: {cubic_stiffness: 0, hysteresis: 0, elastic_wrist: 0, repeatability: 0, link_growth: 0, temperature_profile: linear}
"""
PLAN = """kind: multisine
name: small
poses:
- [0.3, -0.5, 0.9]
joints: [2]
base_frequency_hz: 1.0
lines: [3, 5, 7, 9, 11, 13, 17, 19, 23, 25, 29, 33, 37, 41, 45, 49]
amplitude:
- [4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4]
periods: 4
settle_periods: 1
realisations: 4
signs: true
reference_amplitude: 0.02
reference_frequency_hz: 1.0
kp: [900, 900, 300]
kd: [60, 60, 20]
rate_hz: 500
tau: held
seed: 1
"""


def write_files(folder: Path) -> None:
    """robot.yaml, its URDF, cell.yaml, plan.yaml, and measured poses, logs and targets as the nominal arm would give them, with noise."""
    from flexcal.model.robot import RobotModel

    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("arm.urdf", URDF), ("robot.yaml", ROBOT), ("cell.yaml", CELL), ("plan.yaml", PLAN)):
        (folder / name).write_text(text)
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    rng = np.random.default_rng(7)
    for name, count in (("poses.csv", 30), ("others.csv", 12)):
        q = rng.uniform([-2, -1.2, -1.8], [2, 1.2, 1.8], (count, 3))
        _write_table(folder / name, "pose,q1,q2,q3,x,y,z,sigma", np.column_stack([q, _points(model, q, rng)]))
    q = rng.uniform([-1, -0.8, 0.2], [1, 0.4, 1.2], (5, 3))
    _write_table(folder / "targets.csv", "pose,q1,q2,q3", q)
    visits = np.repeat(q, 5, axis=0)[np.tile(np.arange(5), 5) * 5 + np.repeat(np.arange(5), 5)]
    for name in ("visits.csv", "after.csv"):
        points = _points(model, visits, rng)
        rows = np.column_stack([visits, points])
        header = "pose,q1,q2,q3,x,y,z,sigma"
        _write_table(folder / name, header, rows, np.tile(np.arange(5), 5))
    for name, shift in (("log.csv", 0.0), ("validation.csv", 0.7)):
        _write_log(folder / name, rng, shift)
    _write_foreign(folder / "foreign.txt", model, rng)


def _points(model, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    from flexcal.model.kinematics import point_kinematics

    points = point_kinematics(model, q).position
    return np.column_stack([points + 5e-5 * rng.normal(size=points.shape), np.full(len(q), 5e-5)])


def _write_table(path: Path, header: str, rows: np.ndarray, pose: np.ndarray | None = None) -> None:
    numbers = range(len(rows)) if pose is None else pose
    lines = [
        f"{number}," + ",".join(f"{value:.9g}" for value in row)
        for number, row in zip(numbers, rows, strict=True)
    ]
    path.write_text("\n".join([header, *lines]) + "\n")


def _write_log(path: Path, rng: np.random.Generator, shift: float) -> None:
    """8 s at 100 Hz: sines, with the torques of Pinocchio and friction."""
    import pinocchio

    arm = pinocchio.buildModelFromXML(URDF)
    data = arm.createData()
    t = np.arange(800) / 100
    w = 2 * np.pi * np.array([0.25, 0.5, 0.75])
    size = np.array([0.5, 0.4, 0.6])
    phase = w * (t[:, None] + shift)
    q, dq, ddq = size * np.sin(phase), size * w * np.cos(phase), -size * w**2 * np.sin(phase)
    tau = np.array([pinocchio.rnea(arm, data, *state) for state in zip(q, dq, ddq, strict=True)])
    tau += np.array([1.5, 1.5, 0.5]) * ddq + np.array([9, 9, 3]) * dq + np.array([5, 5, 2]) * np.sign(dq)
    tau += 0.1 * rng.normal(size=tau.shape)
    rows = np.column_stack([t, q, tau, np.zeros(len(t))])
    lines = [",".join(f"{value:.8g}" for value in row) for row in rows]
    path.write_text("\n".join(["t,q1,q2,q3,tau1,tau2,tau3,payload", *lines]) + "\n")


def _write_foreign(path: Path, model, rng: np.random.Generator) -> None:
    q = rng.uniform([-2, -1.2, -1.8], [2, 1.2, 1.8], (12, 3))
    points = _points(model, q, rng)[:, :3]
    lines = ["A tracker's file;;;;;;", "No;J1 [deg];J2 [deg];J3 [deg];X [mm];Y [mm];Z [mm]"]
    for number, row in enumerate(np.column_stack([np.rad2deg(q), 1e3 * points])):
        lines.append(f"{number};" + ";".join(f"{value:.5f}".replace(".", ",") for value in row))
    path.write_text("\n".join(lines) + "\n", encoding="cp1252")


def run_verbs(folder: Path) -> None:
    """What other verbs made of these files: estimates, results, plans, recordings and frequency responses."""
    robot = str(folder / "robot.yaml")
    poses, log = (
        np.genfromtxt(folder / name, delimiter=",", names=True) for name in ("poses.csv", "log.csv")
    )
    assert poses.dtype.names is not None
    rows = structured_to_unstructured(log)[:100]
    write_foreign(
        folder,
        {name: poses[name] for name in poses.dtype.names},
        {"t": rows[:, 0], "q": rows[:, 1:4], "tau": rows[:, 4:7]},
    )
    _flexcal("calibrate", robot, folder / "poses.csv", "--out", folder / "results")
    _flexcal("verify", robot, folder / "others.csv", "--out", folder / "verification")
    _flexcal("compensate", robot, folder / "targets.csv", "--out", folder / "commands.csv")
    virtual = ("--cell", "virtual", "--robot", robot, "--config", folder / "cell.yaml")
    _flexcal("measure", folder / "plan.yaml", *virtual, "--out", folder / "frequency")
    _flexcal("identify", "response", robot, folder / "frequency", "--out", folder / "responses")
    for page in folder.rglob("*.html"):
        page.unlink()


def _flexcal(*arguments: object) -> None:
    from flexcal.cli.main import main

    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        status = main([str(argument) for argument in arguments])
    if status:
        raise RuntimeError(
            f"flexcal {' '.join(map(str, arguments))} failed on valid files: {said.getvalue()}"
        )
