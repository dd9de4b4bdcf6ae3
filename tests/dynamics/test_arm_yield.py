"""What the springs of an arm change of its torques: exact derivatives, another engine, and slopes by what is uncertain."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.data.recordings import Decimation, read_recording
from flexcal.dynamics.payload import FlexibilityCorrection
from flexcal.dynamics.payload.equations import payload_to_link_frame
from flexcal.dynamics.payload.rigid_body import link_frame_from_payload
from flexcal.dynamics.signals import Motion
from flexcal.jobs.experiments import measure
from flexcal.jobs.experiments.measurement import VIRTUAL
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters, torque_regressor
from flexcal.model.vibration import flexible_joint_torque
from flexcal.virtual_cell import write_truth

LAST = slice(50, 60)
CUTOFF_HZ = 400.0


def calm(motion: Motion) -> Motion:
    """A third of the motion, as heavy arms do it."""
    return replace(motion, q=motion.q / 3, dq=motion.dq / 3, ddq=motion.ddq / 3)


def test_the_yield_of_springs(tx90l: RobotModel, sines: Callable[[int, float], Motion]) -> None:
    """None where they are stiff; else what exact derivatives give along a periodic motion, away from the ends of the recording."""
    motion = calm(sines(1000, 100.0))
    stiff = replace(tx90l, springs=replace(tx90l.springs, stiffness=1e7 * tx90l.springs.stiffness))
    assert np.abs(FlexibilityCorrection.of(stiff, motion, ()).shift).max() < 1e-3
    states = motion.q, motion.dq, motion.ddq
    found = FlexibilityCorrection.of(tx90l, motion, ())
    omega = 2j * np.pi * 0.1 * np.arange(501)[:, None]

    def derivatives(bent: np.ndarray) -> np.ndarray:
        return np.array(
            [np.fft.irfft(np.fft.rfft(bent, axis=0) * omega**order, axis=0) for order in range(3)]
        )

    exact, rigid = (
        flexible_joint_torque(robot, *states, derivatives, passes=n) for robot, n in ((tx90l, 3), (tx90l, 1))
    )
    exact -= rigid
    inside = (found.time > 1.0) & (found.time < 9.0)
    there = exact[np.searchsorted(motion.time, found.time[inside] - 1e-6)]
    missed = np.linalg.norm(found.shift[inside] - there, axis=0)[:3]
    assert np.all(missed < 0.05 * np.linalg.norm(there, axis=0)[:3])
    assert np.abs(there).max() > 1.0


def loaded_parameters(model: RobotModel) -> np.ndarray:
    """Of all links, the payload on the last."""
    held, heavy = model.payload, inertial_parameters(model)
    assert held is not None
    heavy[LAST] += payload_to_link_frame(held) @ link_frame_from_payload(
        np.concatenate([[held.mass], held.com, held.moments])
    )
    return heavy


def test_the_yield_is_that_of_the_virtual_cell(tx90l: RobotModel, examples: Path, tmp_path: Path) -> None:
    """MuJoCo's motors against the rigid arm's torques with the yield, well below the resonance: little of the yield is missed.

    Gaps of a tenth of a milliradian and dampers are seen: without either, more is missed.
    """
    for name in ("robot.yaml", "tx90l.urdf"):
        (tmp_path / name).write_bytes((examples / "tx90l" / name).read_bytes())
    cell = (examples / "tx90l" / "cell.yaml").read_text("utf-8").replace("substeps: 1", "substeps: 8")
    cell = cell.replace("torque_noise: 1.0", "torque_noise: 0.001").replace(
        "counts: 262144", "counts: 67108864"
    )
    (tmp_path / "cell.yaml").write_text(cell, "utf-8")
    gaps = {f"joint_{k}.backlash": 1e-4 for k in (2, 3)}
    write_truth(tmp_path / "truth.yaml", tx90l.values | gaps)
    sine, cosine = (
        [[[k] for k in own]] for own in ((2.5, 0.3, -1.9, 1.8, 3.0, 4.2), (-2.2, 1.4, 0.9, 3.0, -1.8, 2.9))
    )
    (tmp_path / "plan.yaml").write_text(
        f"kind: trajectory\nname: swing\npaths:\n  centre: [[0.1, 0.5, 0.7, 0.1, 0.4, 0.1]]\n  sine: {sine}\n  cosine: {cosine}\n"
        "base_frequency_hz: 1.0\nperiods: 6\nsettle_periods: 1\nkp: [3000, 3000, 800, 300, 100, 60]\n"
        "kd: [400, 400, 100, 20, 8, 4]\nrate_hz: 4000\ntau: held\nseed: 0\n"
    )
    measure(
        tmp_path / "robot.yaml",
        tmp_path / "plan.yaml",
        VIRTUAL,
        tmp_path / "seen",
        truth=tmp_path / "truth.yaml",
    )
    (log,) = (tmp_path / "seen").glob("*.parquet")
    motion = Motion.of(read_recording(log, tx90l), CUTOFF_HZ, "held")
    rigid = torque_regressor(tx90l, motion.q, motion.dq, motion.ddq) @ loaded_parameters(tx90l)
    friction = tx90l.drives.viscous * motion.dq + tx90l.drives.coulomb * np.tanh(motion.dq / 0.01)
    seen = motion.torque - rigid - friction - tx90l.drives.rotor_inertia * motion.ddq
    rows = Decimation(640)

    def missed(model: RobotModel) -> np.ndarray:
        found = FlexibilityCorrection.of(model, motion, ())
        columns = {c.joint: c.values for c in found.columns(model, motion, {})}
        return np.linalg.norm(rows.apply(seen.T - np.array([columns[i] for i in range(6)])), axis=1)[:3]

    loose = tx90l.with_values(gaps)
    least, size = missed(loose), np.linalg.norm(rows.apply(seen.T), axis=1)[:3]
    assert np.all(least < np.array([0.005, 0.02, 0.03]) * size)
    undamped = replace(loose, springs=replace(loose.springs, damping=0 * loose.springs.damping))
    assert np.all(missed(tx90l)[1:] > 5 * least[1:]) and missed(undamped)[0] > 2 * least[0]


def test_slopes_by_springs_and_geometry(tx90l: RobotModel, sines: Callable[[int, float], Motion]) -> None:
    """A stiffer drive and a turned axis, as much as they change the torques."""
    motion = calm(sines(500, 100.0))
    sources = ("joint_2.drive.stiffness", "joint_3.offset")
    found = FlexibilityCorrection.of(tx90l, motion, sources)
    stiffer = tx90l.with_values({sources[0]: 1.01 * tx90l.value(sources[0])})
    change = FlexibilityCorrection.of(stiffer, motion, ()).shift - found.shift
    np.testing.assert_allclose(change, np.log(1.01) * found.slopes[:, :, 0], atol=0.02 * np.abs(change).max())
    turned = tx90l.with_values({sources[1]: 1e-3}), tx90l
    heavy = loaded_parameters(tx90l)
    torque = [torque_regressor(robot, motion.q, motion.dq, motion.ddq) @ heavy for robot in turned]
    some = (torque[0] - torque[1])[np.searchsorted(motion.time, found.time - 1e-6)]
    np.testing.assert_allclose(some, 1e-3 * found.slopes[:, :, 1], atol=0.05 * np.abs(some).max())
