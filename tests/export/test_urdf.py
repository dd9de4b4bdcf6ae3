"""The calibrated URDF against the model it came from, read back by Pinocchio and by ourselves."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.export import export_urdf
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import GEOMETRY, RobotModel


@pytest.mark.parametrize("robot", ["tx90l", "ur5"])
def test_forward_kinematics_survive(robot: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    model: RobotModel = request.getfixturevalue(robot).without_springs()
    rng = np.random.default_rng(1)
    owners = [*model.joint_names, "tool"]
    wrong = model.with_values({f"{o}.{key}": 1e-2 * rng.normal() for o in owners for key in GEOMETRY})
    export = export_urdf(wrong, tmp_path / "calibrated.urdf")
    other = pin.buildModelFromUrdf(str(export.path))
    data, frame = other.createData(), other.getFrameId(model.point().name)
    q = rng.uniform(-2, 2, (50, model.n))
    ours = point_kinematics(wrong, q)
    for k in range(len(q)):
        pin.framesForwardKinematics(other, data, q[k])
        np.testing.assert_allclose(data.oMf[frame].translation, ours.position[k], atol=1e-12)
        np.testing.assert_allclose(data.oMf[frame].rotation, ours.orientation[k], atol=1e-12)


def test_the_loss_is_said_in_millimetres(tx90l: RobotModel, tmp_path: Path) -> None:
    loose = tx90l.with_values({"joint_2.backlash": 1e-4})
    export = export_urdf(loose, tmp_path / "calibrated.urdf")
    assert export.lost == ("elastic deflection", "backlash")
    whole = export.loss.error
    assert whole is not None and 0.1e-3 < whole.mean < whole.p95 < whole.max < 10e-3
    said = "cannot carry elastic deflection, backlash. The tool is off by"
    assert said in str(export) and "in 95 % of poses" in str(export)


def test_a_point_named_like_a_link_is_refused(tx90l: RobotModel, tmp_path: Path) -> None:
    from dataclasses import replace

    point = tx90l.point()
    with refused("E-EXPORT-006"):
        export_urdf(replace(tx90l, points={"tool0": replace(point, name="tool0")}), tmp_path / "x.urdf")
    assert not (tmp_path / "x.urdf").exists()


def test_origins_without_an_error_stay_as_they_were_written(tx90l: RobotModel, tmp_path: Path) -> None:
    """Number for number: only joint_3 and, by its length, joint_4 are moved."""
    moved = tx90l.without_springs().with_values({"joint_3.offset": 1e-3, "joint_3.length_x": 1e-3})
    ours = ET.parse(export_urdf(moved, tmp_path / "calibrated.urdf").path).getroot()
    before, after = (
        {j.get("name"): o.attrib for j in root.findall("joint") if (o := j.find("origin")) is not None}
        for root in (ET.parse(tx90l.urdf).getroot(), ours)
    )
    assert {name for name in before if before[name] != after[name]} == {"joint_3", "joint_4"}
