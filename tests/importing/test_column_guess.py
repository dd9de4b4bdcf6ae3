"""Columns are recognised by names that people use, their units by what stands there or by magnitude, and what is left out says why."""

from __future__ import annotations

import numpy as np
import pytest

from flexcal.importing.columns import guess_columns, reasons_unused
from flexcal.importing.tables import parse_name
from flexcal.model.robot import RobotModel

SIX = range(1, 7)
XYZ = ["x", "y", "z"]
HEADERS = [
    ("pose|J*|x|y|z", {"pose": "pose", "q": "J1", "xyz": "x"}),
    ("A*|X|Y|Z|A|B|C", {"q": "A1", "xyz": "X", "angles": "A"}),
    ("q_#|x_mm|y_mm|z_mm", {"q": "q_0", "xyz": "x_mm"}),
    ("time|position[#]|effort[#]", {"t": "time", "q": "position[0]", "tau": "effort[0]"}),
    ("Time [s]|axis*_pos|axis*_vel", {"t": "Time [s]", "q": "axis1_pos", "dq": "axis1_vel"}),
    ("timestamp|actual_q_#|target_q_#|actual_TCP_pose_#", {"t": "timestamp", "q": "actual_q_0"}),
    ("Nr|Achse * [Grad]|X_ist|Y_ist|Z_ist|X_soll|Y_soll|Z_soll", {"pose": "Nr", "q": "Achse 1 [Grad]", "xyz": "X_ist"}),
    ("Point|Joint * (deg)|Measured X [mm]|Measured Y [mm]|Measured Z [mm]|Nominal X [mm]|Nominal Y [mm]|Nominal Z [mm]",
     {"pose": "Point", "q": "Joint 1 (deg)", "xyz": "Measured X [mm]"}),
    ("Punktnr|Achse * [°]|X-Ist (mm)|Y-Ist (mm)|Z-Ist (mm)", {"pose": "Punktnr", "q": "Achse 1 [°]", "xyz": "X-Ist (mm)"}),
    ("t|q*|dq*|tau*|qa*|tau_ext*", {"t": "t", "q": "q1", "dq": "dq1", "tau": "tau1", "qa": "qa1", "tau_ext": "tau_ext1"}),
    ("Time [s]|J* [deg]|V* [deg/s]|M* [Nm]", {"t": "Time [s]", "q": "J1 [deg]", "dq": "V1 [deg/s]", "tau": "M1 [Nm]"}),
    ("shoulder_pan_joint [deg]|shoulder_lift_joint [deg]|elbow_joint [deg]|wrist_1_joint [deg]|wrist_2_joint [deg]|wrist_3_joint [deg]",
     {"q": "shoulder_pan_joint [deg]"}),
    ("shoulder_pan_deg|shoulder_lift_deg|elbow_deg|wrist_1_deg|wrist_2_deg|wrist_3_deg", {"q": "shoulder_pan_deg"}),
    ("t_ms|m*_angle_deg", {"t": "t_ms", "q": "m1_angle_deg"}),
    ("rob1_j*|PosX|PosY|PosZ|Error X|Error Y|Error Z", {"q": "rob1_j1", "xyz": "PosX"}),
    ("theta*|px|py|pz|sigma_x|sigma_y|sigma_z|temp",
     {"q": "theta1", "xyz": "px", "sigma_xyz": "sigma_x", "temperature": "temp"}),
    ("J*|E*|x|y|z", {"q": "J1", "xyz": "x"}),
    ("Punkt|A* [deg]|Mx [mm]|My [mm]|Mz [mm]", {"pose": "Punkt", "q": "A1 [deg]", "xyz": "Mx [mm]"}),
    ('A* [deg]|X ["]|Y ["]|Z ["]', {"q": "A1 [deg]", "xyz": 'X ["]'}),
    ("A* [deg]|dx [mm]|dy [mm]|dz [mm]", {"q": "A1 [deg]"}),
    ("A* [deg]|mx|my|mz", {"q": "A1 [deg]"}),
    ("shoulder_pan|shoulder_lift|elbow|wrist_1|wrist_2|wrist_3|pose.position.x|pose.position.y|pose.position.z|"
     "pose.orientation.x|pose.orientation.y|pose.orientation.z|pose.orientation.w",
     {"q": "shoulder_pan", "xyz": "pose.position.x", "quaternion": "pose.orientation.w"}),
    ("Axe * [deg]|X (mm)|Y (mm)|Z (mm)", {"q": "Axe 1 [deg]", "xyz": "X (mm)"}),
    ("Punto|Eje *|X|Y|Z", {"pose": "Punto", "q": "Eje 1", "xyz": "X"}),
    ("Asse * misurato|X|Y|Z", {"q": "Asse 1 misurato", "xyz": "X"}),
    ("Temps (s)|Axe * mesuré|Couple axe *", {"t": "Temps (s)", "q": "Axe 1 mesuré", "tau": "Couple axe 1"}),
    ("Eixo * (°)|X|Y|Z", {"q": "Eixo 1 (°)", "xyz": "X"}),
    ("Gelenk*|X|Y|Z", {"q": "Gelenk1", "xyz": "X"}),
    ("軸*|X|Y|Z", {"q": "軸1", "xyz": "X"}),
    ("关节*[deg]|x[mm]|y[mm]|z[mm]", {"q": "关节1[deg]", "xyz": "x[mm]"}),
    ("wrist_3_joint|wrist_2_joint|wrist_1_joint|elbow_joint|shoulder_lift_joint|shoulder_pan_joint|x|y|z",
     {"q": "shoulder_pan_joint", "xyz": "x"}),
]  # fmt: skip
"""Headers, and the quantities in them with their first column; * stands for the numbers of the joints from 1, # from 0."""


def written_out(header: str) -> list[str]:
    """The names of all columns."""
    names = []
    for name in header.split("|"):
        count = 6 if set(name) & {"*", "#"} else 1
        names += [name.replace("*", str(i + 1)).replace("#", str(i)) for i in range(count)]
    return names


@pytest.mark.parametrize(("header", "expected"), HEADERS, ids=[header[:40] for header, _ in HEADERS])
def test_headers_that_people_use(ur5, made, rng, header, expected) -> None:
    header = written_out(header)
    columns = {name: rng.uniform(-2, 2, 30) for name in header}
    columns |= {
        name: np.arange(30.0)
        for name in ("pose", "Nr", "Punkt", "Punktnr", "Point", "Punto")
        if name in header
    }
    guess = guess_columns(made(columns), ur5)
    assert {quantity: placed.columns[0] for quantity, placed in guess.placed.items()} == expected
    used = [column for placed in guess.placed.values() for column in placed.columns]
    assert sorted(used + [left.column for left in guess.left_out]) == sorted(header)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ([*(f"J{i}" for i in SIX), *(f"A{i}" for i in SIX)], "J1 and A1 could both begin q"),
        ([f"J{i}" for i in range(1, 8)], "there are 7 of them, but 6 joints"),
        ([*(f"J{i}" for i in SIX), *(f"I{i} [A]" for i in SIX)], "currents need a gain in N m/A"),
        ([*(f"J{i}" for i in SIX), *XYZ, "x2", "y2", "z2"], "x and x2 could both begin xyz"),
    ],
)
def test_what_is_left_out_says_why(ur5, made, rng, header, words) -> None:
    guess = guess_columns(made({name: rng.uniform(-2, 2, 30) for name in header}), ur5)
    assert any(words in reason for reason in reasons_unused(guess.left_out))


def test_units_by_magnitude_and_by_name(ur5, made, rng) -> None:
    q, xyz = rng.uniform(-2.0, 2.0, (30, 6)), rng.uniform(-0.6, 0.6, (30, 3)) + np.array([3.0, 1.0, 0.5])
    for factor, scale, angle, length in ((1.0, 1.0, "rad", "m"), (np.rad2deg(1.0), 1e3, "deg", "mm")):
        columns = {f"J{i + 1}": factor * q[:, i] for i in range(6)} | dict(
            zip("xyz", scale * xyz.T, strict=True)
        )
        foreign = made(columns)
        placed = guess_columns(foreign, ur5).placed
        assert placed["q"].unit == angle and placed["xyz"].unit == length
        np.testing.assert_allclose(placed["q"].values(foreign.table), q, rtol=1e-14)
        np.testing.assert_allclose(placed["xyz"].values(foreign.table), xyz, rtol=1e-14)
    # what stands in the file counts, whatever the magnitude
    small = made({f"J{i + 1}": q[:, i] for i in range(6)}, {f"J{i + 1}": "deg" for i in range(6)})
    assert guess_columns(small, ur5).placed["q"].unit == "deg"


@pytest.mark.parametrize(("step", "unit"), [(1e-3, "s"), (4.0, "ms"), (250.0, "us")])
def test_time_by_the_rate(ur5, made, rng, step, unit) -> None:
    columns = {"time": step * np.arange(50)} | {f"q{i}": rng.uniform(-1, 1, 50) for i in SIX}
    assert guess_columns(made(columns), ur5).placed["t"].unit == unit


def test_without_a_header_order_tells(ur5, made, rng) -> None:
    columns = {"c1": np.arange(30.0)} | {f"c{k}": rng.uniform(-2, 2, 30) for k in range(2, 11)}
    placed = guess_columns(made(columns, named=False), ur5).placed
    assert (
        placed["pose"].columns == ("c1",)
        and placed["q"].columns[0] == "c2"
        and placed["xyz"].columns[-1] == "c10"
    )
    del columns["c9"]
    assert guess_columns(made(columns, named=False), ur5).placed == {}


@pytest.mark.parametrize(
    ("column", "words", "number", "unit"),
    [
        ("J1 [deg]", ("j",), 1, "deg"),
        ("X (mm)", ("x",), None, "mm"),
        ("position[0]", ("position",), 0, None),
        ("JointAngle3", ("joint", "angle"), 3, None),
        ("x_m", ("x",), None, "m"),
        ("time_s", ("time",), None, "s"),
        ("A1", ("a",), 1, None),
        ("j2s6s200_joint_4", ("j", "s", "s", "joint"), 4, None),
        ("speed [rad/s]", ("speed",), None, "rad/s"),
    ],
)
def test_names_taken_apart(column, words, number, unit) -> None:
    name = parse_name(column)
    assert (name.words, name.number, name.unit) == (words, number, unit)


_LINK = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
_JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>'
    '<limit lower="-2" upper="2" velocity="1" effort="9"/></joint>'
)


@pytest.fixture(scope="module")
def scara(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    """Three joints that turn, and the third that slides."""
    folder = tmp_path_factory.mktemp("scara")
    joints = [("arm 1", "revolute"), ("arm 2", "revolute"), ("lift", "prismatic"), ("hand", "revolute")]
    links = "".join(_LINK.format(f"l{k}") for k in range(5))
    parts = "".join(_JOINT.format(name, kind, f"l{k}", f"l{k + 1}") for k, (name, kind) in enumerate(joints))
    (folder / "scara.urdf").write_text(f'<robot name="scara">{links}{parts}</robot>')
    (folder / "robot.yaml").write_text("robot: scara.urdf\n")
    return RobotModel.from_yaml(folder / "robot.yaml")


@pytest.mark.parametrize(
    "header",
    [
        "t|arm 1 Winkel [°]|arm 2 Winkel [°]|lift Weg [mm]|hand Winkel [°]|"
        "arm 1 Moment [Nm]|arm 2 Moment [Nm]|lift Kraft [N]|hand Moment [Nm]",
        "t|J1 [deg]|J2 [deg]|J3 [mm]|J4 [deg]|T1 [Nm]|T2 [Nm]|F3 [N]|T4 [Nm]",
        "t|arm 1|arm 2|lift|hand|arm 1 torque|arm 2 torque|lift force|hand torque",
    ],
)
def test_a_joint_that_slides_has_a_stroke_and_a_force(scara, made, rng, header) -> None:
    names = header.split("|")
    guess = guess_columns(made({name: rng.normal(size=50) for name in names}), scara)
    assert guess.placed["q"].columns == tuple(names[1:5])
    assert guess.placed["tau"].columns == tuple(names[5:])
    assert guess.left_out == ()


def test_forces_of_a_sensor_are_no_torques(ur5, made, rng) -> None:
    names = written_out("t|J*|F* [N]")
    assert "tau" not in guess_columns(made({name: rng.normal(size=50) for name in names}), ur5).placed
