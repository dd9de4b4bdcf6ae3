"""The JSON document by itself: forward kinematics with NumPy alone, and every number with its uncertainty."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from flexcal.estimation import Parameter, Parameters
from flexcal.export.json_model import render_json
from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import Bearings
from flexcal.model.robot import Posterior, RobotModel


def stand(
    document: dict, q: dict[str, float], tilts: dict[str, tuple[float, float]] | None = None
) -> np.ndarray:
    """The first point's frame from nothing but the document; `tilts` (rad) about the bearing's x and y by joint."""
    joints = {joint["name"]: joint for joint in document["joints"]}
    point = next(iter(document["points"].values()))
    at, name = np.array(point["placement"]["matrix"]), point["joint"]
    while name is not None:
        joint = joints[name]
        axis, motion = np.array(joint["axis"]), np.eye(4)
        if joint["type"] == "prismatic":
            motion[:3, 3] = q[name] * axis
        else:
            cosine, sine = np.cos(q[name]), np.sin(q[name])
            across = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            spin = cosine * np.eye(3) + sine * across + (1 - cosine) * np.outer(axis, axis)
            motion[:3, :3] = spin
            if tilts and name in tilts:
                frame, (x, y) = np.array(joint["springs"]["frame"]), tilts[name]
                about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
                about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
                tilt = frame @ about_y @ about_x @ frame.T
                motion[:3, :3] = tilt @ spin if joint["springs"]["bearings"] == "before" else spin @ tilt
        at, name = np.array(joint["placement"]["matrix"]) @ motion @ at, joint["parent"]
    return at


@pytest.mark.parametrize("name", ["tx90l", "ur5"])
def test_numpy_stands_where_the_model_does(
    name: str, request: pytest.FixtureRequest, erroneous, rng: np.random.Generator
) -> None:
    nominal: RobotModel = request.getfixturevalue(name)
    model = erroneous(nominal)
    document = json.loads(render_json(model, nominal).text)
    q = rng.uniform(-3, 3, (30, 6))
    expected = point_kinematics(model, q, jacobians=False)
    for k, own in enumerate(q):
        at = stand(document, dict(zip(model.joint_names, own, strict=True)))
        np.testing.assert_allclose(at[:3, 3], expected.position[k], atol=1e-12)
        np.testing.assert_allclose(at[:3, :3], expected.orientation[k], atol=1e-12)


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_bearings_tilt_as_the_document_says(tx90l: RobotModel, erroneous, bearings: Bearings) -> None:
    model = erroneous(tx90l.with_bearings(bearings))
    document = json.loads(render_json(model, model).text)
    q, deflection = np.array([0.4, -0.7, 1.1, 0.3, 0.8, -0.2]), np.zeros((1, 6, 3))
    deflection[0, :3, :2] = [[0.02, -0.03], [0.05, 0.01], [-0.04, 0.03]]
    tilts = {model.joint_names[i]: (deflection[0, i, 0], deflection[0, i, 1]) for i in range(3)}
    at = stand(document, dict(zip(model.joint_names, q, strict=True)), tilts)
    expected = point_kinematics(model, q[None], deflection, jacobians=False).position[0]
    np.testing.assert_allclose(at[:3, 3], expected, atol=1e-12)


def test_the_three_ways_to_say_a_placement_agree(tx90l: RobotModel, erroneous) -> None:
    from scipy.spatial.transform import Rotation

    document = json.loads(render_json(erroneous(tx90l), tx90l).text)
    for joint in document["joints"]:
        placement = joint["placement"]
        matrix = np.array(placement["matrix"])
        turned = Rotation.from_quat(placement["quaternion_xyzw"]).as_matrix()
        np.testing.assert_allclose(turned, matrix[:3, :3], atol=1e-12)
        np.testing.assert_allclose(placement["xyz"], matrix[:3, 3], atol=0)


def test_nothing_is_left_out(tx90l: RobotModel) -> None:
    """Springs, backlash, drives, inertials, payload and stations; standard deviations where estimated, null elsewhere."""
    names = ("joint_2.backlash", "joint_2.drive.stiffness")
    parameters = Parameters(
        [Parameter(names[0], "rad", 1e-4), Parameter(names[1], "N m/rad", 250e3, scale="log")]
    )
    loose = tx90l.with_values(dict(zip(names, (1e-4, 250e3), strict=True)))
    model = replace(loose, posterior=Posterior(parameters, np.diag([1e-5, 0.02]) ** 2))
    document = json.loads(render_json(model, tx90l).text)
    second = document["joints"][1]
    assert second["backlash"] == {"value": 1e-4, "unit": "rad", "std": pytest.approx(1e-5)}
    assert second["springs"]["drive"]["stiffness"] == {
        "value": 250e3,
        "unit": "N m/rad",
        "std": pytest.approx(5e3),
    }
    assert second["springs"]["bearing_x"]["stiffness"] == {"value": 797.7e3, "unit": "N m/rad", "std": None}
    assert second["drive"]["ratio"] == 45 and second["inertial"]["mass"]["value"] == tx90l.links.mass[1]
    assert document["payload"]["mass"]["value"] == 6.0 and list(document["stations"]) == ["tracker"]
    assert set(document["parameters"]) == set(model.values)
    read = {name: entry["value"] for name, entry in document["parameters"].items()}
    assert {name: value for name, value in read.items() if value is not None} == {
        name: value for name, value in model.values.items() if np.isfinite(value)
    }
