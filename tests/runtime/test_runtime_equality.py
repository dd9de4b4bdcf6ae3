"""The C++ runtime against the library, whose statics are written in NumPy: poses, commands, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.compensation import desired_pose, motor_commands
from flexcal.data.poses import ToolTargets
from flexcal.dynamics.torque_model import TorqueModel
from flexcal.export import render_runtime
from flexcal.kernels import RuntimeRobot
from flexcal.model.kinematics import joint_ranges
from flexcal.model.parts import rotation_vector
from flexcal.model.robot import GEOMETRY, RobotModel
from flexcal.model.statics import tool_at_rest

POSES = 10_000
EXACT = 1e-12
"""m and rad."""
OK, BAD_INPUT, LIMIT, SINGULAR, TOO_FAR, NOT_REACHED, UNSTABLE, OVERFLOW = range(8)

_JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{0}_link"/><origin xyz="{3}" rpy="{4}"/><axis xyz="{5}"/>
<limit lower="{6}" upper="{7}" effort="100" velocity="2"/></joint>
<link name="{0}_link"><inertial><origin xyz="0.03 -0.02 0.1"/><mass value="{8}"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>"""


def on_a_rail(folder: Path) -> RobotModel:
    """Seven joints on a rail beside a branch that weighs but carries no point, with springs, a gap and a payload."""
    rows = [
        ("rail", "prismatic", "base", "0 0 0.2", "0 0 0", "0 1 0", -1.0, 1.0, 60),
        ("j1", "revolute", "rail_link", "0 0 0.3", "0 0.02 0", "0 0 1", -2.9, 2.9, 30),
        ("j2", "revolute", "j1_link", "0.1 0 0.2", "-1.5708 0 0", "0 0 1", -2.0, 2.0, 20),
        ("hose", "revolute", "j2_link", "0.2 0 0.1", "0 0.4 0", "0 0.6 0.8", -1.0, 1.0, 2),
        ("j3", "revolute", "j2_link", "0.5 0 0", "0 0 0.3", "0 0 1", -2.5, 2.5, 15),
        ("j4", "revolute", "j3_link", "0 -0.1 0.05", "-1.5708 0 0", "0 0 1", -2.9, 2.9, 6),
        ("j5", "revolute", "j4_link", "0 0 0.45", "1.5708 0 0", "0 0 1", -2.0, 2.0, 3),
        ("j6", "revolute", "j5_link", "0 0 0.02", "-1.5708 0 0", "0 0 1", -2.9, 2.9, 1),
    ]
    parts = "".join(_JOINT.format(*row) for row in rows)
    (folder / "rail.urdf").write_text(f'<robot name="rail"><link name="base"/>{parts}</robot>')
    (folder / "robot.yaml").write_text(
        "robot: rail.urdf\npoints: {tip: {frame: j6_link, xyz: [0.05, 0.02, 0.2]}, elbow: {frame: j3_link, xyz: [0.1, 0, 0.3]}}\n"
        "payload: {frame: j6_link, mass: 8.0, com: [0.01, 0, 0.12]}\n"
        "elastic: [{joint: j2, drive: {stiffness: 4.0e4}}, {joint: j3, drive: {stiffness: 2.0e4}}]\ngeometry: {backlash: [j2, j4]}\n"
    )
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def disturbed(nominal: RobotModel, seed: int) -> RobotModel:
    """The robot with every error that moves the tool."""
    rng = np.random.default_rng(seed)
    values: dict[str, float] = {}
    for owner in (*nominal.joint_names, "tool"):
        values |= {f"{owner}.{key}": (3e-4 if "length" in key else 5e-4) * rng.normal() for key in GEOMETRY}
    for name in nominal.joint_names:
        values |= {
            f"{name}.transmission_{k}_{wave}": 1e-4 * rng.normal() for k in (1, 2) for wave in ("sin", "cos")
        }
        if nominal.joints[nominal.joint_index(name)].kind == "revolute":
            values |= {
                f"{name}.{key}": 1e-7 * rng.uniform()
                for key in ("gravity_compliance_1", "gravity_compliance_2")
            }
    for name, value in nominal.values.items():
        if name.endswith(".stiffness") and np.isfinite(value):
            values[name] = value * np.exp(0.15 * rng.normal())
        if name.endswith(".hardening"):
            values[name] = 0.2 * rng.uniform()
    values |= {f"{nominal.joint_names[i]}.backlash": 1e-4 for i in nominal.backlash_joints}
    sprung = {joint.name for joint in nominal.elastic}
    values |= {f"{name}.gravity_compliance": 1e-7 for name in nominal.joint_names[1:] if name not in sprung}
    if nominal.payload is not None:
        values["payload.mass"] = 1.05 * nominal.payload.mass
    known = nominal.values
    return nominal.with_values({name: value for name, value in values.items() if name in known})


ROBOTS: dict[str, Callable[[RobotModel, RobotModel, Path], RobotModel]] = {
    "springs after": lambda tx90l, ur5, folder: tx90l,
    "springs before": lambda tx90l, ur5, folder: tx90l.with_bearings("before"),
    "rigid": lambda tx90l, ur5, folder: ur5,
    "rail": lambda tx90l, ur5, folder: on_a_rail(folder),
}


@pytest.fixture(params=ROBOTS)
def robots(
    request: pytest.FixtureRequest, tx90l: RobotModel, ur5: RobotModel, tmp_path: Path
) -> tuple[RobotModel, RobotModel]:
    """A nominal robot, and one as built."""
    nominal = ROBOTS[request.param](tx90l, ur5, tmp_path)
    return nominal, disturbed(nominal, 11)


def runtime(real: RobotModel, nominal: RobotModel) -> RuntimeRobot:
    return RuntimeRobot.read(render_runtime(real, nominal, TorqueModel.of(real).document()).text)


def drawn(nominal: RobotModel, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Motor positions (count, n) and payloads (count,), kg."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(*joint_ranges(nominal), (count, nominal.n))
    return q, np.zeros(count) if nominal.payload is None else rng.uniform(0, nominal.payload.mass, count)


def test_poses_are_those_of_the_library(robots: tuple[RobotModel, RobotModel]) -> None:
    nominal, real = robots
    q, payload = drawn(nominal, POSES, 1)
    arm = runtime(real, nominal)
    for number, name in enumerate(nominal.points):
        target = np.full(POSES, name)
        at = tool_at_rest(real, q, payload, target)
        position, rotation, status = arm.forward(q, number, payload, np.zeros((0, nominal.n)))
        assert (status == OK).all()
        assert np.abs(position - at.kinematics.position).max() < EXACT
        assert np.abs(rotation - at.kinematics.orientation).max() < EXACT
        away = np.linalg.norm(position - arm.nominal(q, number)[0], axis=1)
        assert np.median(away) > 3e-4


def test_poses_on_given_flanks_are_those_of_the_library(robots: tuple[RobotModel, RobotModel]) -> None:
    nominal, real = robots
    q, payload = drawn(nominal, 1000, 2)
    sides = np.random.default_rng(2).choice([-1.0, 1.0], q.shape)
    target = np.full(len(q), next(iter(nominal.points)))
    at = tool_at_rest(real, q, payload, target, flank=sides).kinematics
    position, _, status = runtime(real, nominal).forward(q, 0, payload, sides)
    assert (status == OK).all() and np.abs(position - at.position).max() < EXACT


def test_commands_bring_the_library_s_robot_to_its_targets(robots: tuple[RobotModel, RobotModel]) -> None:
    """To 2e-12: the runtime stops within 1e-12, and the two maps agree to 1e-12."""
    nominal, real = robots
    q, payload = drawn(nominal, POSES, 3)
    arm = runtime(real, nominal)
    command, status, _ = arm.compensate(q, 0, payload)
    targets = ToolTargets(np.arange(len(q)), np.full(len(q), next(iter(nominal.points))), q, payload=payload)
    theirs = motor_commands(real, nominal, targets)
    done = status == OK
    assert np.isnan(command[~done]).all()
    # near singular postures one of the searches may end where the other goes on
    assert (done != theirs.reached).mean() < 0.01
    # an arm that hangs within a gap may rest on either side of it
    rows = np.flatnonzero(done & theirs.unambiguous)
    assert len(rows) > 0.6 * POSES
    aim = desired_pose(real, nominal, targets).subset(rows)
    at = tool_at_rest(real, command[rows], payload[rows], targets.target[rows]).kinematics
    assert np.abs(aim.residual(at)).max() < 2 * EXACT
    # of the many commands of a redundant arm the library takes the nearest as seen from its start
    near = 1e-9 if nominal.n == 6 else 1e-4
    assert np.median(np.abs(command - theirs.q)[rows].max(axis=1)) < near


def test_a_pose_is_reached_from_nearby(tx90l: RobotModel) -> None:
    """Poses that the real robot takes at known commands, sought from 0.05 rad away."""
    real = disturbed(tx90l, 12)
    arm = runtime(real, tx90l)
    rng = np.random.default_rng(4)
    truth = rng.uniform(-0.8, 0.8, (500, 6)) + np.array([0, 0, 1.2, 0, 1.0, 0])
    payload = np.full(500, 2.0)
    position, rotation, _ = arm.forward(truth, 0, payload, np.zeros((0, 6)))
    near = truth + rng.uniform(-0.05, 0.05, truth.shape)
    command, status, _ = arm.inverse(position, rotation, near, 0, payload)
    done = status == OK
    assert done.mean() > 0.95
    at = arm.forward(command[done], 0, payload[done], np.zeros((0, 6)))
    assert np.abs(at[0] - position[done]).max() < 2 * EXACT
    assert np.abs(rotation_vector(at[1] @ np.swapaxes(rotation[done], 1, 2))).max() < 2 * EXACT
    assert np.quantile(np.abs(command - truth)[done], 0.95) < 1e-9


def test_what_cannot_be_had_has_a_status(tx90l: RobotModel) -> None:
    arm = runtime(disturbed(tx90l, 13), tx90l)
    good = np.array([[0.3, 0.5, 1.2, 0.4, 0.9, -0.5]])
    declared = np.array([np.nan])

    def status_at(q: np.ndarray, payload: np.ndarray = declared, point: int = 0) -> int:
        command, status, _ = arm.compensate(q, point, payload)
        assert np.isnan(command).all() == (status[0] != OK)
        return int(status[0])

    assert status_at(good) == OK
    for wrong in (np.nan, np.inf):
        broken = good.copy()
        broken[0, 2] = wrong
        assert status_at(broken) == BAD_INPUT
    assert status_at(good, payload=np.array([-1.0])) == BAD_INPUT
    assert status_at(good, point=7) == BAD_INPUT
    past = good.copy()
    past[0, 1] = 3.0
    assert status_at(past) == LIMIT
    edge = good.copy()
    edge[0, 2] = tx90l.joints[2].upper
    assert status_at(edge) in (OK, LIMIT)
    straight = good.copy()
    straight[0, 4] = 0.0
    assert status_at(straight) == SINGULAR
    position, rotation = arm.nominal(good, 0)
    far = arm.inverse(position + np.array([0.5, 0, 0]), rotation, good, 0, declared)
    assert far[1][0] == TOO_FAR and np.isnan(far[0]).all()
    half_a_turn = rotation @ np.diag([-1.0, -1.0, 1.0])
    assert arm.inverse(position, half_a_turn, good, 0, declared)[1][0] != OK
    mirrored = rotation @ np.diag([1.0, 1.0, -1.0])
    assert arm.inverse(position, mirrored, good, 0, declared)[1][0] == BAD_INPUT


def test_soft_springs_are_told(tx90l: RobotModel) -> None:
    soft = tx90l.with_values({"joint_2.drive.stiffness": 50.0})
    q = np.array([[0.3, -1.3, 1.2, 0.4, 0.9, -0.5]])
    _, _, status = runtime(soft, tx90l).forward(q, 0, np.array([np.nan]), np.zeros((0, 6)))
    assert status[0] == UNSTABLE


def test_a_payload_that_is_not_declared_is_refused(ur5: RobotModel) -> None:
    arm = runtime(ur5, ur5)
    q = np.array([[0.3, -1.2, 1.5, 0.1, 1.6, 0.2]])
    assert arm.compensate(q, 0, np.array([1.0]))[1][0] == BAD_INPUT
    assert arm.compensate(q, 0, np.array([0.0]))[1][0] == OK


@pytest.mark.parametrize("seed", range(20))
def test_broken_files_are_refused_in_a_sentence(tx90l: RobotModel, seed: int) -> None:
    """Members and numbers taken out, replaced or cut: a sentence, or a robot that answers, never a crash."""
    rng = np.random.default_rng(seed)
    text = render_runtime(tx90l, tx90l, TorqueModel.of(tx90l).document()).text
    q = np.array([[0.3, 0.5, 1.2, 0.4, 0.9, -0.5]])
    for _ in range(50):
        first = int(rng.integers(len(text)))
        broken = [
            text[:first],
            text[:first] + text[first + int(rng.integers(1, 40)) :],
            text[:first]
            + str(rng.choice(["null", "[", "}", "1e999", "-", '"', "\\u", "\x00"]))
            + text[first:],
        ][int(rng.integers(3))]
        try:
            arm = RuntimeRobot.read(broken)
        except ValueError as refusal:
            assert str(refusal).strip()
        else:
            arm.forward(
                q[:, : len(arm.joint_names)], 0, np.array([np.nan]), np.zeros((0, len(arm.joint_names)))
            )


def test_other_documents_are_refused(tx90l: RobotModel) -> None:
    document = json.loads(render_runtime(tx90l, tx90l, TorqueModel.of(tx90l).document()).text)
    for change, said in (
        ({"format": "flexcal robot"}, "no robot of 'flexcal export runtime'"),
        ({"version": 2}, "another version than 1"),
        ({"joints": []}, "no joint"),
        ({"points": [document["points"][0] | {"rotation": [2, 0, 0, 0, 1, 0, 0, 0, 1]}]}, "point 1: 'rotation' is no rotation"),
        ({"joints": [document["joints"][0] | {"parent": 0}]}, "joint 1: 'parent' is out of its range"),
        ({"joints": [document["joints"][0] | {"normals": [2, 0, 0, 0, 1, 0]}]}, "joint 1: 'normals' has a vector that is not of unit"),
        ({"joints": [document["joints"][0] | {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, -1]}]}, "joint 1: 'rotation' is no rotation"),
        ({"joints": [document["joints"][0] | {"springs": document["joints"][0]["springs"][::-1]}]}, "joint 1: its springs do not"),
        ({"joints": [document["joints"][0] | {"lower": 1, "upper": 0}]}, "joint 1: 'lower' is above 'upper'"),
        ({"joints": document["joints"][:1] * 101}, "more than 100 joints"),
        ({"points": [document["points"][0] | {"rows": 5}]}, "point 1: 'rows' is neither 3 nor 6"),
        ({"points": [document["points"][0] | {"position": [0, 0, 1.1e20]}]}, "point 1: 'position' has a number beyond 1e20"),
        ({"points": [document["points"][0] | {"holds": 1}]}, "point 1: 'holds' has not an end 'lower' for every joint"),
        ({"points": [document["points"][0] | {"holds": {"lower": [0] * 6, "upper": [1] * 5}}]}, "'holds' has not an end 'upper' for every"),
        ({"points": [document["points"][0] | {"holds": {"lower": ["0"] * 6}}]}, "'holds' has an end that is neither a number nor null"),
        ({"points": [document["points"][0] | {"holds": {"lower": [1] * 6, "upper": [0] * 6}}]}, "'holds' has a lower end above"),
        ({"reach": -1}, "'reach' is negative"),
        ({"robot": "x" * (4 << 20)}, "more than 4194304 bytes"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=said):
            RuntimeRobot.read(json.dumps(document | change))


def test_texts_that_are_no_json_are_refused() -> None:
    for text in ("+1", "01", "1.", ".5", "1e", "-", "1e999", '"\\udc00"', "NaN", "[" * 100, "{} {}"):
        with pytest.raises(ValueError, match="line 1: "):
            RuntimeRobot.read(text)


def test_a_robot_beyond_the_runtime_is_not_exported(tx90l: RobotModel) -> None:
    for value in (1e30, np.nan):
        huge = tx90l.with_values({f"{tx90l.joints[1].link}.mass": value})
        with refused("E-EXPORT-007", tx90l.name):
            render_runtime(huge, tx90l, TorqueModel.of(tx90l).document())


def test_results_too_large_for_a_number_have_a_status(tx90l: RobotModel) -> None:
    arm = runtime(tx90l, tx90l)
    q, declared = np.array([[0.3, 0.5, 1.2, 0.4, 0.9, -0.5]]), np.array([np.nan])
    fast = np.full((1, 6), 1e200)
    torque, status, _ = arm.torque(q, fast, fast, declared)
    assert status[0] == OVERFLOW and np.isnan(torque).all()
    assert arm.torque(q, q, q, declared)[1][0] == OK


def _numbers(value: object) -> list[tuple[dict[str, Any] | list[Any], Any]]:
    """Every number of a document, as what holds it and its place there."""
    if not isinstance(value, dict | list):
        return []
    items = list(value.items() if isinstance(value, dict) else enumerate(value))
    own = [(value, key) for key, item in items if isinstance(item, float)]
    return own + [place for _, item in items for place in _numbers(item)]


def test_models_with_odd_numbers_are_refused_or_answer_with_numbers(root: Path) -> None:
    """What is read has a finite result, or a status, for every call."""
    rng = np.random.default_rng(3)
    odd = [0.0, -1.0, 1e-300, -1e-3, 1e6, -1e12, 1e20, 1e21, 1e50, -1e300]
    read = answered = 0
    for file in sorted((root / "tests" / "runtime" / "corpus").glob("*.json")):
        text = file.read_text(encoding="utf-8")
        for k in range(1 if file.name.startswith("refused") else 40):
            document = json.loads(text)
            places = _numbers(document)
            if k > 0:
                holder, key = places[rng.integers(len(places))]
                holder[key] = odd[rng.integers(len(odd))]
            try:
                arm = RuntimeRobot.read(json.dumps(document))
            except ValueError as refusal:
                assert str(refusal) and (k > 0 or file.name.startswith("refused"))
                continue
            assert k > 0 or not file.name.startswith("refused")
            read += 1
            n = len(arm.joint_names)
            q, dq, ddq = rng.uniform(-2, 2, (3, 20, n))
            declared, free = np.full(20, np.nan), np.zeros((0, n))
            position, rotation, status = arm.forward(q, 0, declared, free)
            results = [(np.column_stack([position, rotation.reshape(20, 9)]), status)]
            results += [arm.compensate(q, 0, declared)[:2]]
            results += [arm.torque(q, dq, ddq, declared, elastic)[:2] for elastic in (False, True)]
            for values, status in results:
                assert np.isfinite(values[status == OK]).all()
                answered += np.count_nonzero(status == OK)
    assert read > 50 and answered > 2000
