"""The MJCF file of an elastic robot resonates as the measured one: its matrices from MuJoCo, its response by solving with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal import (
    CellConfig,
    FrequencyResponse,
    RobotModel,
    VirtualCell,
    draw_truth,
    exciting_plan,
    frequency_plan,
    frequency_responses,
    identify_inertials,
    identify_stiffness,
    read_yaml,
)
from flexcal.export import export_mjcf

mujoco = pytest.importorskip("mujoco")
SEED = 5
BAND = 1.73
"""Standard deviations of a complex number within which it lies in 95 % of cases: |z|² is exponentially distributed."""


def response(path: Path, measured: FrequencyResponse, values: dict[str, float], pose: int) -> np.ndarray:
    """Motor torque to motor acceleration (L, n, n) of the file, at the lines and in the pose of a measured response.

    Joints that were not excited are held. The drives' loss in this pose and the delay of their torques are those that the fit has: a file
    for all poses has neither.
    """
    loaded = mujoco.MjModel.from_xml_path(str(path))
    names = [loaded.joint(k).name for k in range(loaded.njnt) if "." not in loaded.joint(k).name]
    excited = [loaded.joint(name).dofadr[0] for name in measured.joints]
    held = [loaded.joint(name).dofadr[0] for name in names if name not in measured.joints]
    data = mujoco.MjData(loaded)
    data.qpos[[loaded.joint(name).qposadr[0] for name in names]] = measured.q_mean
    mujoco.mj_forward(loaded, data)
    mass = np.zeros((loaded.nv, loaded.nv))
    mujoco.mj_fullM(loaded, data, mass)
    bias, rest = data.qfrc_bias.copy(), data.qpos.copy()
    stiffness = np.diag(loaded.jnt_stiffness[loaded.dof_jntid].reshape(loaded.nv, -1)[:, 0])
    for k in range(loaded.nv):
        data.qpos[:] = rest
        data.qpos[k] += 1e-6
        mujoco.mj_forward(loaded, data)
        stiffness[:, k] += (data.qfrc_bias - bias) / 1e-6
    damping = np.diag(loaded.dof_damping)
    for name, k in zip(measured.joints, excited, strict=True):
        damping[k, k] = values[f"{name}.viscous.pose_{pose}"]
    free = [k for k in range(loaded.nv) if k not in held]
    own = [free.index(k) for k in excited]
    late = np.array([values[f"{name}.delay"] for name in measured.joints])
    result = []
    for frequency in measured.frequencies_hz:
        s = 2j * np.pi * frequency
        dynamic = (s**2 * mass + s * damping + stiffness)[np.ix_(free, free)]
        result.append((s**2 * np.linalg.inv(dynamic))[np.ix_(own, own)] * np.exp(-s * late))
    return np.array(result)


@pytest.mark.slow
def test_the_file_resonates_within_the_band_of_the_measurement(examples: Path, tmp_path: Path) -> None:
    folder = examples / "tx90l"
    nominal = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    config = read_yaml(folder / "cell.yaml", CellConfig)
    truth = draw_truth(nominal, config.spread, np.random.default_rng([SEED, 0]))
    cell = VirtualCell(nominal.with_values(truth), config, SEED, controller_model=nominal)
    motions = exciting_plan(nominal, count=2, seed=SEED)
    believed = identify_inertials(nominal, motions, list(cell.record(motions))).model
    plan = frequency_plan(nominal, folder / "frequency_poses.csv", "default", SEED)
    plan = replace(plan, poses=plan.poses[[0, 5]], realisations=3)
    excited = [nominal.joint_names[k] for k in plan.joints]
    measured = list(frequency_responses(plan, cell.record(plan), joint_names=excited))
    found = identify_stiffness(believed, measured, plan=plan, seed=SEED)
    export_mjcf(found.model, tmp_path / "elastic.xml")
    export_mjcf(found.model.without_springs(), tmp_path / "rigid.xml")
    inside: dict[str, list[np.ndarray]] = {"elastic": [], "rigid": []}
    for pose, own in enumerate(measured, start=1):
        diagonal = np.arange(len(excited)) * (len(excited) + 1)
        std = np.sqrt(own.covariance[:, diagonal, diagonal].real)
        peak = np.abs(np.diagonal(own.response, axis1=1, axis2=2)).argmax(axis=0)
        for name, within in inside.items():
            simulated = response(tmp_path / f"{name}.xml", own, found.estimate.values, pose)
            difference = np.diagonal(simulated - own.response, axis1=1, axis2=2)
            within.append(np.abs(difference) < BAND * std)
            if name == "elastic":
                at = np.abs(np.diagonal(simulated, axis1=1, axis2=2)).argmax(axis=0)
                np.testing.assert_allclose(own.frequencies_hz[at], own.frequencies_hz[peak], rtol=0.04)
    assert np.mean(inside["elastic"]) > 0.85
    assert np.mean(inside["rigid"]) < 0.5 * np.mean(inside["elastic"])
