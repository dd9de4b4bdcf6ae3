"""The stepped loop against the exact response of its discrete scheme, and against continuous time as the step shrinks."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from refusals import refused
from scipy.linalg import eigh

from flexcal.model.robot import RobotModel
from flexcal.model.vibration import linearise as model_linearise
from flexcal.model.vibration import transfer_matrix
from flexcal.units import DEGREE
from flexcal.virtual_cell import CellConfig, FrictionConfig
from flexcal.virtual_cell.closed_loop import LoopCommand, LoopGains, LoopLog, run_loop
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.plant import Plant, PlantLinearisation, build_plant, linearise

mujoco = pytest.importorskip("mujoco")

POSE = np.array([0, 45, 60, 0, 45, 0]) * DEGREE
LINES_HZ = np.array([3, 7, 11, 13, 17, 23, 27, 31, 37, 43, 53, 61, 71, 79])
LINEAR = CellConfig(friction=FrictionConfig(scale=0.0))
PD = LoopGains(np.array([3000.0, 3000.0, 800.0]), np.array([700.0, 700.0, 180.0]), rate_hz=4000.0)


def discrete_response(
    system: PlantLinearisation, plant: Plant, step: float, substeps: int, frequencies_hz: np.ndarray
) -> np.ndarray:
    """Exact response (L, m, m), rad per N m, of motor positions at the ticks to the torque held between them.

    One plant step is w₊ = w + h M⁻¹ (B τ̄ − D (23 w − 16 w₋ + 5 w₋₋)/12 − C (q + h (2 w − 3 w₋ + w₋₋)/12) − (K − C) q),
    q₊ = q + h w₊; τ̄ is the held torque, at a tick the mean of both; C is the springs' share of K.
    """
    motors, springs = plant.motors, plant.springs[:, 0]
    d, m = len(system.mass), len(motors)
    inverse = np.linalg.inv(system.mass)
    one, zero = np.eye(d), np.zeros((d, d))
    pull, drag = inverse @ system.stiffness * step, inverse @ system.damping * step
    bend = inverse @ np.diag(springs) * step**2 / 12
    rate = [-pull, one - 23 / 12 * drag - 2 * bend, 16 / 12 * drag + 3 * bend, -5 / 12 * drag - bend]
    drift = [one + step * rate[0], *(step * part for part in rate[1:])]
    advance = np.block([drift, rate, [zero, one, zero, zero], [zero, zero, one, zero]])
    kick = step * inverse[:, motors]
    push = np.vstack([step * kick, kick, np.zeros((2 * d, m))])
    response = []
    for frequency in frequencies_hz:
        z = np.exp(2j * np.pi * frequency * step * substeps)
        shares = [0.5 * (1 + 1 / z)] + [1.0] * (substeps - 1)
        drive = sum(
            np.linalg.matrix_power(advance, substeps - 1 - i) @ push * share for i, share in enumerate(shares)
        )
        tick = np.linalg.matrix_power(advance, substeps)
        response.append(np.linalg.solve(z * np.eye(4 * d) - tick, drive)[motors])
    return np.array(response)


def continuous_response(
    system: PlantLinearisation, motors: np.ndarray, tick: float, frequencies_hz: np.ndarray
) -> np.ndarray:
    """The same of the continuous plant, the torque held over a tick: (M s² + D s + K)⁻¹ sinc(ωT/2) e^{−jωT/2}."""
    s = 2j * np.pi * frequencies_hz[:, None, None]
    whole = np.linalg.inv(s**2 * system.mass + s * system.damping + system.stiffness)
    hold = np.sinc(frequencies_hz * tick) * np.exp(-1j * np.pi * frequencies_hz * tick)
    return whole[:, motors][:, :, motors] * hold[:, None, None]


@dataclass(frozen=True)
class Run:
    plant: Plant
    system: PlantLinearisation
    response: np.ndarray


def run(plant: Plant, gains: LoopGains, excitation: np.ndarray) -> LoopLog:
    found = rest(plant, mujoco.MjData(plant.mjmodel), POSE[:3])
    flat = np.zeros_like(excitation)
    command = LoopCommand(excitation + found.torque, flat + POSE[:3], flat)
    return run_loop(plant, gains, command, start=found.position, start_rate=np.zeros(plant.mjmodel.nv))


def measured_response(model: RobotModel, gains: LoopGains, config: CellConfig = LINEAR) -> Run:
    """Small multisines in three orthogonal experiments, both signs, last of four periods of 1 s."""
    step = 1 / (gains.rate_hz * gains.substeps)
    plant = build_plant(model, config, q=POSE, free=(0, 1, 2), payload=6.0, time_step=step)
    t = np.arange(4 * round(gains.rate_hz)) / gains.rate_hz
    period = round(gains.rate_hz)
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, (3, len(LINES_HZ)))
    spectra = []
    for experiment in range(3):
        turned = phases + 2 * np.pi / 3 * experiment * np.arange(3)[:, None]
        sines = 1e-2 * np.stack(
            [np.cos(2 * np.pi * np.outer(t, LINES_HZ) + phase).sum(1) for phase in turned], axis=1
        )
        plus, minus = run(plant, gains, sines), run(plant, gains, -sines)
        both = np.hstack([plus.position - minus.position, plus.torque - minus.torque])[-period:]
        spectra.append(np.fft.rfft(both, axis=0)[LINES_HZ])
    stacked = np.stack(spectra, axis=2)
    response = stacked[:, :3] @ np.linalg.inv(stacked[:, 3:])
    found = rest(plant, mujoco.MjData(plant.mjmodel), POSE[:3])
    return Run(plant, linearise(plant, found.position), response)


def scaled_error(response: np.ndarray, expected: np.ndarray) -> float:
    """Largest error of an element relative to the geometric mean of its row's and column's diagonal elements."""
    diagonal = np.abs(np.diagonal(expected, axis1=1, axis2=2))
    return float(np.abs((response - expected) / np.sqrt(diagonal[:, :, None] * diagonal[:, None])).max())


@pytest.mark.parametrize(("rate_hz", "substeps"), [(4000.0, 1), (2000.0, 2), (1000.0, 4), (4000.0, 2)])
def test_stepped_response_is_that_of_the_discrete_scheme(
    tx90l: RobotModel, rate_hz: float, substeps: int
) -> None:
    done = measured_response(tx90l, replace(PD, rate_hz=rate_hz, substeps=substeps))
    step = 1 / (rate_hz * substeps)
    expected = discrete_response(done.system, done.plant, step, substeps, LINES_HZ)
    assert scaled_error(done.response, expected) < 3e-6


def test_friction_with_viscous_part_only_stays_linear(tx90l: RobotModel) -> None:
    model = tx90l.with_values({f"joint_{i}.coulomb": 0.0 for i in (1, 2, 3)})
    done = measured_response(model, PD, CellConfig())
    expected = discrete_response(done.system, done.plant, 0.25e-3, 1, LINES_HZ)
    assert scaled_error(done.response, expected) < 3e-6


@pytest.mark.parametrize("substeps", [1, 4])
def test_discretisation_error_is_below_the_usual_bound_and_falls_with_the_step(
    tx90l: RobotModel, substeps: int
) -> None:
    plant = build_plant(tx90l, LINEAR, q=POSE, free=(0, 1, 2), payload=6.0)
    found = rest(plant, mujoco.MjData(plant.mjmodel), POSE[:3])
    system = linearise(plant, found.position)
    bands = np.arange(3, 80, 0.5)
    errors = []
    for step in (0.25e-3, 0.125e-3):
        continuous = continuous_response(system, plant.motors, step * substeps, bands)
        errors.append(scaled_error(discrete_response(system, plant, step, substeps, bands), continuous))
    assert errors[0] < (2 * np.pi * 80 * 0.25e-3) ** 2 / 12
    assert errors[1] < errors[0] / 4


@pytest.mark.parametrize(("rate_hz", "substeps"), [(4000.0, 1), (1000.0, 4)])
def test_bias_on_the_stiffnesses_is_below_half_a_percent(
    tx90l: RobotModel, rate_hz: float, substeps: int
) -> None:
    """First-order bias of a fit of all springs and rotors to the discrete response of three poses."""
    lines = np.arange(3.25, 80, 0.5)
    names = [
        n for n in tx90l.values if n.endswith((".stiffness", ".damping", "rotor_inertia")) and n[6] in "123"
    ]
    rows, differences = [], []
    for pose in ((0, 60, -105, 80, 67, 0), (0, 56, -8, -100, 41, 0), (0, -50, -74, 138, 51, 0)):
        q = np.array(pose) * DEGREE
        plant = build_plant(tx90l, LINEAR, q=q, free=(0, 1, 2), payload=6.0)
        system = linearise(plant, rest(plant, mujoco.MjData(plant.mjmodel), q[:3]).position)
        stepped = discrete_response(system, plant, 0.25e-3, substeps, lines)
        exact = continuous_response(system, plant.motors, 1 / rate_hz, lines)
        reference = transfer_matrix(
            model_linearise(
                tx90l.with_values({f"joint_{i}.viscous": 0.0 for i in (1, 2, 3)}), q, 6.0, derivatives=names
            ),
            lines,
        )
        diagonal = np.abs(np.diagonal(reference.response, axis1=1, axis2=2))
        scale = 1 / np.sqrt(diagonal[:, :, None] * diagonal[:, None])
        s2 = -((2 * np.pi * lines[:, None, None]) ** 2)
        hold = (np.sinc(lines / rate_hz) * np.exp(-1j * np.pi * lines / rate_hz))[:, None, None]
        differences.append(((stepped - exact) / hold * s2 * scale).ravel())
        assert reference.names == tuple(names)
        size = np.array([tx90l.value(n) for n in names])
        rows.append((reference.derivatives * size * scale[..., None]).reshape(-1, len(names)))
    left, right = np.concatenate(rows), np.concatenate(differences)
    bias = np.linalg.lstsq(np.vstack([left.real, left.imag]), np.concatenate([right.real, right.imag]))[0]
    stiffness = [abs(b) for n, b in zip(names, bias, strict=True) if n.endswith(".stiffness")]
    assert max(stiffness) < 1e-3


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_free_oscillations_keep_their_energy_and_frequency(tx90l: RobotModel, mode: int) -> None:
    """No damping, friction, gravity or control: released in one mode's shape, the motors swing in it for 2 s as at the start."""
    values = {name: 0.0 for name in tx90l.values if name.endswith(".damping")}
    model = replace(tx90l, config=replace(tx90l.config, gravity=(0.0, 0.0, 0.0))).with_values(values)
    plant = build_plant(model, LINEAR, q=POSE, free=(0, 1, 2), payload=6.0, time_step=0.25e-3)
    start = np.zeros(12)
    start[plant.motors] = POSE[:3]
    system = linearise(plant, start)
    squares, shapes = eigh(system.stiffness, system.mass)
    omega, shape = np.sqrt(squares[3 + mode]), shapes[:, 3 + mode]  # the first three are rigid motions
    zero = np.zeros((8000, 3))
    loose = LoopGains(np.zeros(3), np.zeros(3), rate_hz=4000.0)
    begin = start + 1e-8 * shape / np.abs(shape).max()
    rate = (begin - start) * omega**2 * 0.125e-3  # of the swing half a step before its turning point
    log = run_loop(plant, loose, LoopCommand(zero, zero, zero), start=begin, start_rate=rate)
    t = np.arange(8000) * 0.25e-3
    swing = (
        (log.position - POSE[:3])
        @ shape[plant.motors]
        / np.sum((begin - start)[plant.motors] * shape[plant.motors])
    )
    np.testing.assert_allclose(swing, np.cos(omega * t), atol=2e-3)


def test_a_diverging_loop_is_reported(tx90l: RobotModel) -> None:
    plant = build_plant(tx90l, LINEAR, q=POSE, free=(0, 1, 2), payload=6.0, time_step=0.25e-3)
    wrong = LoopGains(np.full(3, -1e5), np.zeros(3), rate_hz=4000.0)
    with refused("E-CELL-015"):
        run(plant, wrong, np.full((8000, 3), 1.0))


def test_the_step_of_the_plant_must_be_the_controllers(tx90l: RobotModel) -> None:
    plant = build_plant(tx90l, LINEAR, q=POSE, free=(0, 1, 2), payload=6.0, time_step=0.25e-3)
    with refused("E-CELL-014"):
        run(plant, replace(PD, rate_hz=1000.0), np.zeros((10, 3)))
