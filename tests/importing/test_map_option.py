"""`--map`: what the user says of columns over the guess, in flexcal's names, with signs, factors, units and offsets."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from flexcal.errors import InputError
from flexcal.importing.columns import apply_map, guess_columns


@pytest.fixture
def foreign(made, rng):
    columns = {f"J{i}": rng.uniform(-100, 100, 12) for i in range(1, 7)}
    columns |= {
        "X [mm]": rng.uniform(-500, 500, 12),
        "h, up": rng.uniform(-500, 500, 12),
        "Y": rng.uniform(-500, 500, 12),
    }
    columns |= {f"I{i}": rng.uniform(-9, 9, 12) for i in range(1, 7)} | {
        "T": np.full(12, 20.0),
        "who": np.full(12, "me"),
    }
    return made(columns)


def mapped(ur5, foreign, *entries):
    return apply_map(entries, guess_columns(foreign, ur5), foreign, ur5)


def test_signs_factors_units_and_offsets(ur5, foreign) -> None:
    table = foreign.numbers
    guess = mapped(
        ur5, foreign, "q2=-J2[deg]+90,q3=J4", "q4=J3[rad]", "x=X [mm]", "y=-2*Y[mm]", "z=h, up[um]"
    )
    q = guess.placed["q"].values(foreign.table)
    np.testing.assert_allclose(q[:, 0], np.deg2rad(table["J1"]))
    np.testing.assert_allclose(q[:, 1], np.deg2rad(90 - table["J2"]))
    np.testing.assert_allclose(q[:, 2], np.deg2rad(table["J4"]))
    np.testing.assert_allclose(q[:, 3], table["J3"])
    xyz = guess.placed["xyz"].values(foreign.table)
    np.testing.assert_allclose(
        xyz, np.stack([table["X [mm]"] * 1e-3, -2e-3 * table["Y"], 1e-6 * table["h, up"]], axis=1)
    )
    torques = mapped(ur5, foreign, *(f"tau{i}={10 * i}*I{i}[A]" for i in range(1, 7))).placed["tau"]
    np.testing.assert_allclose(torques.values(foreign.table)[:, 2], 30 * table["I3"])


def test_the_signals_block_says_the_same(ur5, foreign, tmp_path) -> None:
    """What is printed for robot.yaml, read by the reader of robot.yaml, gives the same numbers."""
    import shutil

    from flexcal.data.tables import mapped_signals
    from flexcal.jobs.setup import add_signals
    from flexcal.model.robot import RobotModel

    shutil.copytree(ur5.path.parent, tmp_path / "ur5")
    placed = mapped(
        ur5, foreign, "q2=-J2[deg]+90,q3=J4", "q4=J3[rad]", "x=X [mm]", "y=-2*Y[mm]", "z=h, up[um]"
    ).placed
    robot = tmp_path / "ur5" / "robot.yaml"
    before = robot.read_text()
    add_signals(robot, {name: item.config() for name, item in placed.items() if name in ("q", "xyz")})
    assert robot.read_text().startswith(before)
    signals = mapped_signals(RobotModel.from_yaml(robot, estimates=False))
    for name in ("q", "xyz"):
        np.testing.assert_allclose(
            signals[name].values(foreign.table), placed[name].values(foreign.table), rtol=1e-12
        )
    add_signals(robot, {"q": placed["q"].config()})
    with pytest.raises(InputError) as caught:  # the sentence ends in the lines to write
        add_signals(robot, {"q": {"columns": [f"A{i}" for i in range(6)]}})
    assert caught.value.code == "E-RUN-092"


def test_a_guess_is_taken_back(ur5, foreign) -> None:
    guess = mapped(ur5, foreign, "x=X [mm]", "y=Y", "z=h, up", "temperature=none")
    assert "temperature" not in guess.placed and "q" in guess.placed
    taken = mapped(ur5, foreign, *(f"tau{i}=J{i}" for i in range(1, 7)))
    assert "q" not in taken.placed, "the columns of the guess went to the torques"


@pytest.mark.parametrize(
    ("entry", "refusal"),
    [
        ("q7=J1", ["E-IMPORT-014", "q7"]),
        ("J1=q1", ["E-IMPORT-013", "J1"]),
        ("q1=J9", ["E-IMPORT-020", "J9", "did you mean"]),
        ("q1", ["E-IMPORT-012"]),
        ("q1=J1[kg]", ["E-IMPORT-017", "kg", "rad, deg"]),
        ("x=Y", ["E-IMPORT-021", "y, z"]),
        ("tau1=I1[A]", ["E-IMPORT-019"]),
        ("q1=who", ["E-IMPORT-018"]),
        ("q1=0*J1", ["E-IMPORT-016"]),
        ("q=J1", ["E-IMPORT-015", "q1, q2"]),
        ("target=J99", ["E-IMPORT-020", "J99"]),
    ],
)
def test_wrong_entries(ur5, foreign, entry: str, refusal: list[str]) -> None:
    with refused(*refusal):
        mapped(ur5, foreign, entry)
