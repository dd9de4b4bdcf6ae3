"""The UR5 example is what its README says: converted from the published numbers, consistent with its model."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest


@pytest.fixture(scope="module")
def convert(examples: Path) -> ModuleType:
    specification = importlib.util.spec_from_file_location("convert", examples / "ur5_tracker" / "convert.py")
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def published_row(sign: float = 1.0) -> dict[str, str]:
    """Pose 0 of the grid as published; sign = -1 reverses the error."""
    row = {
        "step_order": "0",
        "x_t": "-430.32784075885013",
        "y_t": "-6.2740647628546",
        "z_t": "-98.6368469428076",
    }
    error = {"x_dif": -2.144122241149887, "y_dif": -3.5212622371454003, "z_dif": 0.8144149428075877}
    joints = (
        -22.933297010882566,
        -43.71915584236375,
        135.39784676276338,
        -94.74032099477175,
        55.416784894781806,
        -5.552224723991238,
    )
    row |= {name: repr(sign * value) for name, value in error.items()}
    return row | {f"joint_{number + 1}": repr(value) for number, value in enumerate(joints)}


def test_conversion_reproduces_the_shipped_file(convert: ModuleType, examples: Path) -> None:
    lines = (examples / "ur5_tracker" / "grid.csv").read_text().splitlines()
    assert ",".join(convert.HEADER) == lines[0]
    assert ",".join(convert.convert(published_row())) == lines[1]


def test_reversed_sign_is_refused(convert: ModuleType) -> None:
    with pytest.raises(SystemExit, match="sign of dif"):
        convert.convert(published_row(sign=-1.0))


@pytest.mark.parametrize(("name", "poses"), [("grid.csv", 1000), ("random.csv", 20)])
def test_nominal_point_lies_where_the_tracker_saw_it(name: str, poses: int, examples: Path) -> None:
    table = np.loadtxt(examples / "ur5_tracker" / name, delimiter=",", skiprows=1)
    assert table.shape == (poses, 10)
    assert np.array_equal(table[:, 0], np.arange(poses))
    model = pin.buildModelFromUrdf(str(examples / "ur5_tracker" / "ur5.urdf"))
    data, frame = model.createData(), model.getFrameId("tool0")
    half_turn = np.diag([-1.0, -1.0, 1.0])  # base_link to the UR controller's base frame
    errors = []
    for row in table:
        pin.framesForwardKinematics(model, data, row[1:7])
        errors.append(row[7:] - half_turn @ data.oMf[frame].act(np.array([0.0, 0.0, 0.031])))
    mean = np.linalg.norm(errors, axis=1).mean()
    assert 2.4e-3 < mean < 2.8e-3  # published raw error: 2.566 mm on the random poses
