"""Valid files of a small arm of three joints, one of them elastic, which the cases break: made anew in every session, a few seconds."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import struct
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
    <collision>
      <origin xyz="0.15 0 0"/>
      <geometry><mesh filename="block.stl" scale="0.1 0.1 0.1"/></geometry>
    </collision>
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
dynamics: {friction: classic, cutoff_hz: 5, decimation: 2}
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


URSCRIPT = """def pick():
  # "brackets ( in comments" do not count
  set_tcp(p[0, 0, .031, 0.3, 0.0, 0.0])
  set_payload(0.0, [0.0, 0.0, 0.0])
  global home = [0.1, -0.3, 0.4, 0.2, 0.5, 0.2]
  global above=p[0.35, 0.05, 0.4, 0.0, 1.6, 0.0]
  movej(home, a=1.4, v=1.05)
  while (True):
    movej(get_inverse_kin(above, qnear=home), a=1.4, v=1.05)
    movel(p[0.36, 0.02, 0.35, 0.0, 1.6, 0.0], a=1.2, v=0.25)
    movel(pose_add(above, p[0, 0, 0.1, 0, 0, 0]), a=1.2, v=0.25)
  end
end
"""
KRL_SOURCE = """&ACCESS RVP
DEF  Pick( )
$BWDSTART=FALSE
PTP XHOME
$TOOL={X 31.0,Y 0.0,Z 100.0,A 0.0,B 30.0,C 0.0}
$BASE={X 200.0,Y -100.0,Z 50.0,A 45.0,B 0.0,C 0.0}
PTP XP1 C_PTP
LIN XP2 C_DIS
PTP {A1 5,A2 -10.5,A3 15,A4 0,A5 30,A6 7.25,E1 0}
LIN XP1:{Z 50}
END
"""
KRL_DATA = """&ACCESS RVP
DEFDAT  PICK PUBLIC
DECL E6AXIS XHOME={A1 0.0,A2 -20.0,A3 20.0,A4 0.0,A5 20.0,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
DECL E6POS XP1={X 60.0,Y 40.0,Z 300.0,A 0.0,B 90.0,C 0.0,S 2,T 2,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
DECL E6POS XP2={X 60.0,Y 40.0,Z 250.0,A 0.0,B 90.0,C 0.0,S 2,T 2,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
ENDDAT
"""
FANUC = """/PROG  WELD
/ATTR
OWNER\t\t= MNEDITOR;
DEFAULT_GROUP\t= 1,*,*,*,*;
/MN
   1:  UFRAME_NUM=0 ;
   2:  UTOOL_NUM=1 ;
   3:J P[1:home] 100% FINE    ;
   4:L P[2] 100mm/sec CNT10    ;
   5:L P[2] 100mm/sec FINE Offset,PR[7]    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 1,\t
\tJ1=     5.000 deg,\tJ2=    10.000 deg,\tJ3=   -15.000 deg,
\tJ4=     3.000 deg,\tJ5=   -60.000 deg,\tJ6=    20.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',
\tX =   350.000  mm,\tY =    50.000  mm,\tZ =   400.000  mm,
\tW =   180.000 deg,\tP =   -10.000 deg,\tR =     0.000 deg
};
/END
"""
XACRO = """<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="upper" value="0.45"/>
  <xacro:arg name="mount" default="0.4"/>
  <xacro:macro name="joint" params="name above below *place axis:='0 1 0' limit">
    <joint name="${name}" type="revolute">
      <parent link="${above}"/><child link="${below}"/><xacro:insert_block name="place"/>
      <axis xyz="${axis}"/><limit lower="${-limit}" upper="${limit}" effort="200" velocity="4"/>
    </joint>
  </xacro:macro>
  <link name="base"/><link name="shoulder"/><link name="upper"/><link name="lower"/><link name="flange"/>
  <xacro:joint name="axis_1" above="base" below="shoulder" axis="0 0 1" limit="2.8"><origin xyz="0 0 0.1"/></xacro:joint>
  <xacro:joint name="axis_2" above="shoulder" below="upper" limit="2"><origin xyz="0.05 0 ${upper - 0.2}"/></xacro:joint>
  <xacro:joint name="axis_3" above="upper" below="lower" limit="${1.2 * 2}"><origin xyz="${upper} 0 0" rpy="0.1 0 0"/></xacro:joint>
  <joint name="mount" type="fixed">
    <parent link="lower"/><child link="flange"/><origin xyz="$(arg mount) 0 0" rpy="0 0 0"/>
  </joint>
</robot>
"""
STUDY = """kind: calibrate
robot: robot.yaml
poses: [poses.csv]
options: {terms: [kinematic]}
resampling: {bootstrap: 2}
"""
MOTORS = {
    f"axis_{k}": {
        "id": k,
        "drive_mode": 0,
        "homing_offset": 17 * k - 50,
        "range_min": 700 + k,
        "range_max": 3300,
    }
    for k in (1, 2, 3)
}


def write_files(folder: Path) -> None:
    """robot.yaml, its URDF, cell.yaml, plan.yaml, and measured poses, logs and targets as the nominal arm would give them, with noise."""
    from flexcal.model.robot import RobotModel

    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("arm.urdf", URDF), ("robot.yaml", ROBOT), ("cell.yaml", CELL), ("plan.yaml", PLAN)):
        (folder / name).write_text(text)
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    triangles = [struct.pack("<12fH", 0, 0, 0, *(x for k in face for x in corners[k]), 0) for face in faces]
    (folder / "block.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(triangles))
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
    for name, shift, payload in (("log.csv", 0.0, 0.0), ("loaded.csv", 0.3, 2.0)):
        _write_log(folder / name, rng, shift, payload)
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


def _write_log(path: Path, rng: np.random.Generator, shift: float, payload: float) -> None:
    """8 s at 100 Hz: sines, with the torques of Pinocchio and friction."""
    import pinocchio

    arm = pinocchio.buildModelFromXML(URDF)
    held = pinocchio.Inertia(payload, np.array([0.45, 0, 0.02]), np.zeros((3, 3)))
    arm.appendBodyToJoint(3, held, pinocchio.SE3.Identity())
    data = arm.createData()
    t = np.arange(800) / 100
    w = 2 * np.pi * np.array([0.25, 0.5, 0.75])
    size = np.array([0.5, 0.4, 0.6])
    phase = w * (t[:, None] + shift)
    q, dq, ddq = size * np.sin(phase), size * w * np.cos(phase), -size * w**2 * np.sin(phase)
    tau = np.array([pinocchio.rnea(arm, data, *state) for state in zip(q, dq, ddq, strict=True)])
    tau += np.array([1.5, 1.5, 0.5]) * ddq + np.array([9, 9, 3]) * dq + np.array([5, 5, 2]) * np.sign(dq)
    tau += 0.1 * rng.normal(size=tau.shape)
    rows = np.column_stack([t, q, tau, np.full(len(t), payload)])
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
    _write_cells(folder)
    for page in folder.rglob("*.html"):
        page.unlink()


def _write_cells(folder: Path) -> None:
    """Files for the other verbs: programs of a six-joint arm, a servo arm, images, touches, a fleet, exciting motions, a visit."""
    examples = Path(__file__).parents[2] / "examples"
    for cell, example, table, rows in (
        ("irb", "irb120_program", "points.csv", 40),
        ("servo", "servo_arm", "moves.csv", 1000),
    ):
        shutil.copytree(examples / example, folder / cell)
        lines = (folder / cell / table).read_text().splitlines(keepends=True)
        (folder / cell / table).write_text("".join(lines[: rows + 1]))
    _flexcal("calibrate", folder / "irb/robot.yaml", folder / "irb/points.csv", "--terms", "kinematic")
    programs = {"pick.script": URSCRIPT, "pick.src": KRL_SOURCE, "pick.dat": KRL_DATA, "weld.ls": FANUC}
    for name, text in programs.items():
        (folder / "irb" / name).write_text(text)
    (folder / "arm.xacro").write_text(XACRO)
    (folder / "study.yaml").write_text(STUDY)
    shutil.copytree(folder / "irb", folder / "project", ignore=shutil.ignore_patterns("pick*", "weld*"))
    (folder / "motors.json").write_text(json.dumps(MOTORS, indent=4))
    rows = (folder / "others.csv").read_text().splitlines()[1:]
    joints = [row.split(",")[1:4] for row in rows]
    (folder / "touches.csv").write_text("\n".join(["q1,q2,q3", *map(",".join, joints)]) + "\n")
    degrees = [",".join(f"{np.rad2deg(float(angle)):.6f}" for angle in q) for q in joints[:3]]
    table = ["plan,pose,q1_deg,q2_deg,q3_deg", *(f"default,{k},{q}" for k, q in enumerate(degrees))]
    (folder / "frequency_poses.csv").write_text("\n".join(table) + "\n")
    ticks = [[2000 + round(float(angle) * 652) for angle in q] for q in joints]
    places = [[1e3 * float(x) for x in row.split(",")[4:7]] for row in rows]
    table = [",".join(map(str, [*one, *place])) for one, place in zip(ticks, places, strict=True)]
    (folder / "ticks.csv").write_text(
        "\n".join(["axis_1.pos,axis_2.pos,axis_3.pos,x_mm,y_mm,z_mm", *table]) + "\n"
    )
    chance = np.random.default_rng(1)
    t, tau, q, velocity = np.arange(600) / 500, 5 * chance.normal(size=600), np.zeros(600), 0.0
    for k in range(1, len(t)):
        velocity += (tau[k - 1] - 4 * velocity - 100 * q[k - 1]) / 500
        q[k] = q[k - 1] + velocity / 500
    q += 2e-4 * chance.normal(size=len(t))
    table = [f"{a:.3f},{b:.6f},{c:.9f}" for a, b, c in zip(t, tau, q, strict=True)]
    (folder / "random.csv").write_text("\n".join(["t,tau1,q1", *table]) + "\n")
    named = [",".join([*q, name]) for q, name in zip(joints, ("origin", "x", "xy"), strict=False)]
    (folder / "fixture.csv").write_text("\n".join(["q1,q2,q3,point", *named]) + "\n")
    _flexcal("recheck", folder / "robot.yaml", folder / "others.csv", "--out", folder / "recheck")
    rows = (examples / "irb120_program/points.csv").read_text().splitlines(keepends=True)
    for k in range(3):
        robot = folder / f"fleet/robot_{k}"
        robot.mkdir(parents=True)
        for name in ("robot.yaml", "arm.urdf"):
            shutil.copy(folder / "irb" / name, robot)
        (robot / "poses.csv").write_text("".join([rows[0], *rows[1 + k :: 3]]))
        _flexcal("calibrate", robot / "robot.yaml", robot / "poses.csv", "--out", robot / "results")
    _flexcal("fleet", folder / "fleet", "--prior", folder / "prior.yaml", "--out", folder / "fleet.csv")
    _flexcal("export", "runtime", folder / "robot.yaml", "--out", folder / "runtime.json")
    small = ("--count", "1", "--duration", "5", "--searches", "1", "--steps", "1", "--harmonics", "2")
    _flexcal("design", "trajectory", folder / "robot.yaml", *small, "--out", folder / "exciting.yaml")
    virtual = ("--cell", "virtual", "--robot", folder / "robot.yaml", "--config", folder / "cell.yaml")
    _flexcal("measure", folder / "exciting.yaml", *virtual, "--out", folder / "exciting")
    _write_images(folder / "eye")


def _write_images(folder: Path) -> None:
    """A camera on the arm's hand, and images of a board in two sizes."""
    import cv2

    (folder / "images").mkdir(parents=True)
    shutil.copy(folder.parent / "arm.urdf", folder)
    (folder / "robot.yaml").write_text(
        "robot: arm.urdf\npoints: {eye: {frame: flange, xyz: [0.05, 0.03, 0.12]}}\nmeasurements:\n"
        "  eye: {kind: camera, size: [320, 240], board: {kind: chessboard, columns: 9, rows: 7, square: 0.03}}\n"
    )
    rows = ["pose,q1,q2,q3,image"]
    for k, suffix in enumerate(("png", "jpg", "png", "png", "bmp", "tiff")):
        page = np.pad(
            np.kron(255 * (np.indices((7, 9)).sum(axis=0) % 2), np.ones((20 + k, 20 + k))),
            9,
            constant_values=255,
        )
        image = np.full((240, 320), 255, np.uint8)
        image[: page.shape[0], : page.shape[1]] = page[:240, :320]
        cv2.imwrite(str(folder / f"images/{k}.{suffix}"), image)
        rows.append(f"{k},0.{k},-0.{k},0.{k}5,{k}.{suffix}")
    (folder / "images/joints.csv").write_text("\n".join(rows) + "\n")


def _flexcal(*arguments: object) -> None:
    from flexcal.cli.main import main

    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        status = main([str(argument) for argument in arguments])
    if status:
        raise RuntimeError(
            f"flexcal {' '.join(map(str, arguments))} failed on valid files: {said.getvalue()}"
        )
