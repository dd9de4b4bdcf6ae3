"""Sensors on the arm as further outputs of stage 1: their prediction against MuJoCo, its derivatives, what they determine, coverage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import refused

from flexcal.elasticity.identification.fit import ResponseData, fit_responses
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResponseModel,
    ResponseResidual,
    Tolerances,
    check_sensors,
    stiffness_parameters,
)
from flexcal.elasticity.time_periodic import ReferenceMotion, reference_shift
from flexcal.estimation import Estimate
from flexcal.export import mjcf_spec
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel, spring_names, with_blocks
from flexcal.model.vibration import linearise, transfer_matrix

SENSORS = """
sensors:
  hand: {frame: flange, xyz: [0.03, 0.02, 0.05], direction: [0.2, 0.3, 1.0]}
  forearm: {frame: link_4, xyz: [0.03, 0.12, 0.05], direction: [1, 0, 0]}
  beam: {frame: flange, xyz: [0.03, 0.02, 0.05], direction: [0.3, 1, 0.2], kind: vibrometer}
  probe: {frame: link_3, xyz: [0.3, 0.02, 0.05], direction: [0.3, 1, 0.2], kind: vibrometer, quantity: displacement}
"""


@pytest.fixture(scope="module")
def sensing(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    """The TX90L without backlash, with torques as measured, and with two accelerometers, a vibrometer and a displacement probe."""
    folder = tmp_path_factory.mktemp("sensing")
    for name in ("robot.yaml", "tx90l.urdf"):
        (folder / name).write_bytes((examples / "tx90l" / name).read_bytes())
    file = folder / "robot.yaml"
    file.write_text(file.read_text("utf-8") + SENSORS, "utf-8")
    model = RobotModel.from_yaml(file)
    geometry = replace(model.config.geometry, backlash=())
    prior = replace(model.config.prior, torque_constant=0.0)
    return replace(model, config=replace(model.config, geometry=geometry, prior=prior))


@pytest.fixture(scope="module")
def sensed() -> Callable[..., list[FrequencyResponse]]:
    """Responses of a true robot with some sensors; `noise` relative on the torque and, independent, on the readings."""

    def make(
        truth: RobotModel,
        poses: np.ndarray,
        sensors: tuple[str, ...],
        noise: float,
        rng: np.random.Generator | None = None,
        gains: np.ndarray | float = 1.0,
        step: int = 8,
    ) -> list[FrequencyResponse]:
        frequencies = np.arange(13, 320, step) * 0.25
        result = []
        for k, q in enumerate(poses):
            system = linearise(truth, q, 0.0, sensors=[truth.sensors[name] for name in sensors])
            stacked = transfer_matrix(system, frequencies).response
            stacked[:, 3:] *= np.broadcast_to(gains, len(sensors))[:, None]
            m = stacked.shape[1]
            one = noise**2 * stacked @ np.swapaxes(stacked, 1, 2).conj()
            one[:, range(3, m), range(3, m)] += (noise * np.linalg.norm(stacked[:, 3:], axis=2).mean(0)) ** 2
            covariance = np.zeros((len(one), 3 * m, 3 * m), dtype=complex)
            for c in range(3):
                covariance[:, m * c : m * c + m, m * c : m * c + m] = one
            if rng is not None:
                draw = rng.standard_normal((2, len(one), m, 3)) / np.sqrt(2)
                stacked = stacked + np.linalg.cholesky(one) @ (draw[0] + 1j * draw[1])
            own = (np.arange(3)[:, None] * m + np.arange(3)).ravel()
            square = covariance[:, own[:, None], own]
            result.append(
                FrequencyResponse(
                    frequencies_hz=frequencies,
                    response=stacked[:, :3],
                    covariance=square,
                    noise_covariance=square,
                    degrees_of_freedom=45.0,
                    realisations=stacked[None, :, :3],
                    joints=truth.joint_names[:3],
                    q_mean=q,
                    payload=0.0,
                    pose=k,
                    sample_time=1 / 4000,
                    sensors=sensors,
                    sensor_response=stacked[:, 3:] if sensors else None,
                    joint_covariance=covariance if sensors else None,
                )
            )
        return result

    return make


def test_readings_are_those_of_mujoco(sensing: RobotModel, poses) -> None:
    """MuJoCo's own accelerometer, velocity and position sensors, differentiated numerically about its own equilibrium."""
    import mujoco

    q = poses["default"][0]
    model = sensing.with_values({f"joint_{i}.coulomb": 0.0 for i in (1, 2, 3)})
    spec = mjcf_spec(model, q=q, free=[0, 1, 2])
    kinds = {
        "hand": mujoco.mjtSensor.mjSENS_ACCELEROMETER,
        "forearm": mujoco.mjtSensor.mjSENS_ACCELEROMETER,
        "beam": mujoco.mjtSensor.mjSENS_FRAMELINVEL,
        "probe": mujoco.mjtSensor.mjSENS_FRAMEPOS,
    }
    for name, kind in kinds.items():
        sensor = model.sensors[name]
        body = spec.body(model.joints[sensor.joint].link)
        body.add_site(name=name, pos=sensor.xyz)
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name)
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    names = [compiled.joint(j).name for j in range(compiled.njnt)]
    motors = [names.index(model.joint_names[i]) for i in range(3)]
    springs = [k for k in range(len(names)) if k not in motors]

    def forces(position: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = position, 0.0, 0.0
        mujoco.mj_forward(compiled, data)
        return data.qfrc_passive - data.qfrc_bias

    rest = np.zeros(compiled.nv)
    rest[motors] = q[:3]
    for _ in range(6):
        columns = [
            (forces(rest + 1e-6 * u) - forces(rest - 1e-6 * u)) / 2e-6 for u in np.eye(len(rest))[springs]
        ]
        rest[springs] -= np.linalg.solve(np.array(columns)[:, springs].T, forces(rest)[springs])
    hold = np.zeros(compiled.nv)
    hold[motors] = -forces(rest)[motors]

    def out(position: np.ndarray, rate: np.ndarray, torque: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:] = position, rate
        data.qfrc_applied[:] = hold
        data.qfrc_applied[motors] += torque
        mujoco.mj_forward(compiled, data)
        read = [data.sensor(name).data @ model.sensors[name].direction for name in kinds]
        return np.concatenate([data.qacc, read])

    def slope(of: Callable[[np.ndarray], np.ndarray], size: int, h: float) -> np.ndarray:
        return np.array([(of(h * u) - of(-h * u)) / (2 * h) for u in np.eye(size)]).T

    still, d = np.zeros(compiled.nv), compiled.nv
    by_q = slope(lambda x: out(rest + x, still, np.zeros(3)), d, 1e-6)
    by_v = slope(lambda x: out(rest, x, np.zeros(3)), d, 1e-5)
    by_u = slope(lambda x: out(rest, still, x), 3, 1e-2)
    frequencies = np.array([1.0, 4.0, 11.0, 30.0, 75.0])
    s = 2j * np.pi * frequencies[:, None, None]
    moved = np.linalg.solve(
        s**2 * np.eye(d) - s * by_v[:d] - by_q[:d], np.broadcast_to(by_u[:d], (5, d, 3)).astype(complex)
    )
    read = (by_q[d:] + s * by_v[d:]) @ moved + by_u[d:]
    system = linearise(model, q, sensors=[model.sensors[name] for name in kinds])
    own = transfer_matrix(system, frequencies).response
    for row, name in enumerate(kinds):
        difference = np.abs(own[:, 3 + row] - read[:, row]).max(axis=1) / np.abs(own[:, 3 + row]).max(axis=1)
        assert difference.max() < 2e-5, (name, difference)


def test_tilt_matters_at_low_frequencies(sensing: RobotModel, poses) -> None:
    """Below a few hertz an accelerometer feels gravity turn as much as it feels itself move."""
    q = poses["default"][0]
    frequencies = np.array([0.3, 3.0, 30.0])
    full = linearise(sensing, q, sensors=[sensing.sensors["forearm"]])
    assert full.sensed is not None
    deaf = replace(full, sensed=replace(full.sensed, tilt=0 * full.sensed.tilt))
    with_tilt, without = (transfer_matrix(system, frequencies).response[:, 3] for system in (full, deaf))
    share = np.linalg.norm(with_tilt - without, axis=1) / np.linalg.norm(with_tilt, axis=1)
    assert share[0] > 0.5 and 1e-3 < share[1] < 0.5 and share[2] < 0.01


def test_readings_along_a_very_slow_motion_average_the_frozen_ones(sensing: RobotModel, poses) -> None:
    """In the quasi-static limit with free motors the response is the mean of those along the motion, linearised one by one."""
    q, frequencies, size = poses["default"][1], np.linspace(5, 60, 12), np.deg2rad(1.0)
    sensors = tuple(sensing.sensors.values())
    motion = ReferenceMotion(size, 1e-5, np.zeros(3), np.zeros(3), np.zeros((3, 1)))
    shift = reference_shift(sensing, q, None, frequencies, motion, sensors=sensors)
    still = transfer_matrix(linearise(sensing, q, sensors=sensors), frequencies).response
    frozen = []
    for angle in 2 * np.pi * np.arange(8) / 8:
        at = q.copy()
        at[:3] += size * np.sin(angle)
        frozen.append(transfer_matrix(linearise(sensing, at, sensors=sensors), frequencies).response)
    expected = np.mean(frozen, axis=0) - still
    for row in range(expected.shape[1]):
        largest = np.abs(expected[:, row]).max()
        np.testing.assert_allclose(shift[:, row], expected[:, row], atol=0.05 * largest, err_msg=str(row))


def test_jacobian_is_that_of_finite_differences(sensing: RobotModel, poses, drawn, sensed, rng) -> None:
    truth = drawn(sensing, rng, inertias=True)
    responses = sensed(truth, poses["default"][:2], ("hand", "beam", "probe"), 0.1, rng, step=48)
    parameters = stiffness_parameters(sensing, responses)
    model = ResponseModel.of(sensing, responses, parameters)
    residual = ResponseResidual.of(model, responses, CovarianceWeighting())
    unit = np.array([{"s": 1e-3, "m": 0.1}.get(unit, 1.0) for unit in parameters.units])
    x = parameters.coordinates() + 0.05 * unit * rng.standard_normal(len(parameters))
    rows, jacobian = residual.linearise(x)
    np.testing.assert_allclose(rows, residual.residual(x), rtol=1e-12)
    for k, size in enumerate(unit):
        step = np.zeros(len(x))
        step[k] = 1e-5 * size
        numeric = (residual.residual(x + step) - residual.residual(x - step)) / (2 * step[k])
        np.testing.assert_allclose(jacobian[:, k], numeric, atol=1e-5 * np.abs(jacobian[:, k]).max() + 1e-9)


def test_a_sensor_determines_the_forearm_that_motors_do_not_see(
    sensing: RobotModel, poses, drawn, sensed
) -> None:
    """Without a payload the forearm's torsion bearing hardly moves a motor: known to its prior. An accelerometer off its axis, whose place
    is known, sees it."""
    rng = np.random.default_rng(11)
    placed = {
        name: replace(sensor, config=replace(sensor.config, position_std=0.0, direction_std=0.0))
        for name, sensor in sensing.sensors.items()
    }
    sensing = replace(sensing, sensors=placed)
    truth = drawn(sensing, rng, inertias=False)
    name = "joint_3.bearing_y.stiffness"
    std, error = {}, {}
    for sensors in ((), ("forearm",)):
        responses = sensed(truth, poses["default"][:2], sensors, 0.02, np.random.default_rng(5), 1.03)
        data = ResponseData(tuple(responses), tolerances=Tolerances.none(), inertias_known=True)
        parameters = data.parameters(sensing)[0]
        start = {
            n: truth.values.get(n, v)
            for n, v in zip(parameters.names, parameters.natural(parameters.coordinates()), strict=True)
        }
        fit = fit_responses(sensing, data, parameters.coordinates(start)).estimate
        number = fit.parameters.index(name)
        std[sensors] = float(np.sqrt(fit.covariance[number, number]))
        error[sensors] = np.log(fit.values[name] / truth.value(name))
        if sensors:
            assert fit.values["sensor.forearm.sensitivity"] == pytest.approx(1.03, abs=0.01)
    assert std[()] > 0.5 and std["forearm",] < 0.06
    assert abs(error["forearm",]) < 3 * std["forearm",]


def errors_over_std(
    seed: int, sensing: RobotModel, q: np.ndarray, drawn: Callable, sensed: Callable
) -> list[float]:
    """Of springs and sensitivities of one robot, on the logarithmic scale."""
    rng = np.random.default_rng(1000 + seed)
    truth = drawn(sensing, rng, inertias=True)
    gains = np.exp(0.02 * rng.standard_normal(2))
    placed = {
        name: sensor.misplaced(sensor.mounting_std * rng.standard_normal(5))
        for name, sensor in truth.sensors.items()
    }
    moved = replace(truth, sensors=placed)
    responses = sensed(moved, q, ("hand", "forearm"), 0.02, rng, gains, step=16)
    data = ResponseData(tuple(responses), tolerances=Tolerances.none())
    parameters = data.parameters(sensing)[0]
    natural = zip(parameters.names, parameters.natural(parameters.coordinates()), strict=True)
    start = {name: truth.values.get(name, value) for name, value in natural}
    fit = fit_responses(sensing, data, parameters.coordinates(start)).estimate
    wanted = {**truth.values, "sensor.hand.sensitivity": gains[0], "sensor.forearm.sensitivity": gains[1]}
    return [
        float(np.log(fit.values[name] / wanted[name]) / np.sqrt(fit.covariance[number, number]))
        for number, name in enumerate(fit.parameters.names)
        if name.endswith((".stiffness", ".sensitivity"))
    ]


@pytest.mark.slow
def test_intervals_cover(sensing: RobotModel, poses, drawn, sensed) -> None:
    """95 % intervals of springs and sensitivities over 40 robots, links, sensitivities and mounting as far off as their priors say.

    The fit starts at the truth: what finds the basin, the search, is not looked at here.
    """
    scores = np.array(over_seeds(errors_over_std, range(40), sensing, poses["default"][:3], drawn, sensed))
    inside = np.mean(np.abs(scores) < 1.96)
    print(f"{100 * inside:.1f} % of {scores.size} intervals")
    assert 0.91 < inside < 0.98


@pytest.mark.parametrize(
    ("gain", "refusal"),
    [
        (1 / 9.80665, ["E-STIFF-010", "hand", "9.8 times smaller", "in g"]),
        (-1.0, ["E-STIFF-011", "hand"]),
        (1000.0, ["E-STIFF-010", "hand", "times larger"]),
    ],
)
def test_readings_of_another_unit_or_direction_are_refused(
    sensing: RobotModel, poses, sensed, gain: float, refusal: list[str]
) -> None:
    responses = sensed(sensing, poses["default"][:1], ("hand",), 0.01, gains=gain, step=8)
    with refused(*refusal):
        check_sensors(sensing, responses)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_springs_far_from_the_truth_are_no_reason_to_refuse_readings(
    sensing: RobotModel, poses, sensed, factor: float
) -> None:
    """Modes are elsewhere than expected, and some lines lie on them; the readings are right all the same."""
    springs = [name for name in spring_names(sensing) if name.endswith(".stiffness")]
    truth = sensing.with_values({name: factor * sensing.value(name) for name in springs})
    for q in poses["default"]:
        check_sensors(sensing, sensed(truth, q[None], ("hand", "forearm", "beam", "probe"), 0.02, gains=1.05))


def test_responses_with_sensors_round_trip(sensing: RobotModel, poses, sensed, tmp_path: Path) -> None:
    (response,) = sensed(sensing, poses["default"][:1], ("hand", "beam"), 0.01)
    response.save(tmp_path / "r.npz")
    back = FrequencyResponse.load(tmp_path / "r.npz")
    assert back.sensors == ("hand", "beam") and back.outputs[-1] == "beam"
    np.testing.assert_array_equal(back.stacked, response.stacked)
    np.testing.assert_array_equal(back.stacked_covariance, response.stacked_covariance)
    np.testing.assert_allclose(back.stacked_std[:, :3], back.std, rtol=1e-12)


def test_estimates_with_sensors_are_read_by_other_verbs(
    sensing: RobotModel, poses, sensed, tmp_path: Path
) -> None:
    responses = sensed(sensing, poses["default"][:1], ("hand", "beam"), 0.01)
    parameters = stiffness_parameters(sensing, responses)
    count = len(parameters)
    estimate = Estimate(
        parameters, 1e-4 * np.eye(count), count, (), (True,) * count, 0.0, 0.0, 1, "converged", "", 1
    )
    assert {"sensor.hand.sensitivity", "sensor.beam.direction_2"} <= set(parameters.names)
    with_blocks(sensing, {"stiffness": estimate}, tmp_path / "estimates.yaml")


def test_a_sensor_that_is_not_declared_is_refused(
    tx90l: RobotModel, sensing: RobotModel, poses, sensed
) -> None:
    responses = sensed(sensing, poses["default"][:1], ("hand",), 0.01)
    with refused("E-STIFF-006", "hand"):
        stiffness_parameters(tx90l, responses)


def test_a_direction_of_zeros_is_refused(sensing: RobotModel, tmp_path: Path) -> None:
    text = sensing.path.read_text("utf-8").replace("direction: [1, 0, 0]", "direction: [0, 0, 0]")
    (tmp_path / "tx90l.urdf").write_bytes(sensing.urdf.read_bytes())
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    with refused("E-ROBOT-005"):
        RobotModel.from_yaml(tmp_path / "robot.yaml")
