"""The virtual robot: a MuJoCo model of the elastic arm, and the forces on it that are not MuJoCo's.

MuJoCo does the multibody dynamics: mass matrix, gravity, Coriolis, the step. Springs with their dead band, dampers and motor friction
are applied to it, so that the laws are those of the identified model (a dead band, tanh friction) and their rates lie at the right instant.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.export import mjcf_spec
from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.virtual_cell.config import CellConfig

if TYPE_CHECKING:
    import mujoco


def recurrence(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, springs: np.ndarray, step: float
) -> np.ndarray:
    """Matrix (4 d, 4 d) of one free step of (q, w, w₋, w₋₋); `springs` (d,) is the springs' share of the stiffness's diagonal."""
    d = len(mass)
    one, zero = np.eye(d), np.zeros((d, d))
    pull, drag, bend = np.linalg.solve(
        mass, np.stack([stiffness * step, damping * step / 12, np.diag(springs) * step**2 / 12])
    )
    rate = [-pull, one - 23 * drag - 2 * bend, 16 * drag + 3 * bend, -5 * drag - bend]
    drift = [one + step * rate[0], *(step * part for part in rate[1:])]
    return np.block([drift, rate, [zero, one, zero, zero], [zero, zero, one, zero]])


def growth_rate(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, springs: np.ndarray, step: float
) -> float:
    """Fastest growth rate, 1/s, of the free recurrence; an arm that would fall over grows by a few 1/s, a step too long by hundreds."""
    radius = np.abs(np.linalg.eigvals(recurrence(mass, damping, stiffness, springs, step))).max()
    return float(np.log(radius) / step)


TWIST_OF_CUBIC = 1e-3  # rad at which `cubic_stiffness` is the relative stiffening
WRIST_DAMPING = 1e-3  # s: damping over stiffness of the joints that `elastic_wrist` makes elastic
FALLING = 20.0  # 1/s: faster growth than any arm's fall
_PASSIVE = (
    "CONSTRAINT",
    "EQUALITY",
    "FRICTIONLOSS",
    "LIMIT",
    "CONTACT",
    "PASSIVE",
    "SPRING",
    "DAMPER",
    "ACTUATION",
    "SENSOR",
)
_UNWANTED = (
    *_PASSIVE,
    "EULERDAMP",
    "AUTORESET",
    "WARMSTART",
    "REFSAFE",
    "CLAMPCTRL",
    "FILTERPARENT",
    "MIDPHASE",
    "ISLAND",
)


@dataclass(frozen=True, eq=False)
class Plant:
    """A compiled MuJoCo model of d coordinates and m free motors, with what acts on it.

    `coordinates` (d,) names; `joints` (m,), `motors` (m,), `twists` (m,): joint index, motor coordinate and twist coordinate (-1: rigid
    drive) of each free motor; `springs` (d, 6) per coordinate: stiffness, damping, half gap, cubic (1/rad²), hysteresis (N m) and
    its width (rad); `frictions` (m, 5): viscous, Coulomb, its velocity, Stribeck, its velocity. SI, at the joint.
    """

    mjmodel: mujoco.MjModel
    coordinates: tuple[str, ...]
    joints: np.ndarray
    motors: np.ndarray
    twists: np.ndarray
    springs: np.ndarray
    frictions: np.ndarray

    @property
    def elastic(self) -> np.ndarray:
        """Indices of the coordinates with a spring."""
        return np.flatnonzero(self.springs[:, 0] > 0)


_LIGHT = 1e-6
"""Mass (kg) and inertia (kg m²) of a link that has none."""


@dataclass(frozen=True, eq=False)
class PlantLinearisation:
    """M q̈ + D q̇ + K q about a position: mass, damping, stiffness (d, d) with gravity's share, and the force of gravity (d,)."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    gravity: np.ndarray


def build_plant(
    model: RobotModel,
    config: CellConfig,
    *,
    q: np.ndarray | None = None,
    free: Collection[int] | None = None,
    payload: float | None = None,
    time_step: float | None = None,
    sensors: Sequence[ArmSensor] = (),
) -> Plant:
    """The plant of a true robot, its joints outside `free` locked at `q` (n,), to be stepped by `time_step` s; see `mjcf_spec`.

    Every one of the `sensors` has a site, whose axes are those of its link.
    """
    import mujoco

    rigid = set(range(model.n)) - {e.index for e in model.elastic}
    wrist = rigid if config.mismatch.elastic_wrist > 0 else set()
    if wrist:
        stiffness = config.mismatch.elastic_wrist
        model = model.with_drive_springs(dict.fromkeys(wrist, (stiffness, WRIST_DAMPING * stiffness)))
    spec = mjcf_spec(model, q=q, free=free, payload=payload)
    for sensor in sensors:
        spec.body(model.joints[sensor.joint].link).add_site(name=sensor_site(sensor), pos=sensor.xyz)
    for body in spec.bodies:
        if (
            body.explicitinertial and body.mass == 0
        ):  # of a URDF without inertials; MuJoCo has no link without mass
            body.mass, body.fullinertia = _LIGHT, [_LIGHT, _LIGHT, _LIGHT, 0, 0, 0]
    spec.compiler.fusestatic = True
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    bits = (getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}", None) for name in _UNWANTED)
    spec.option.disableflags = sum(int(bit) for bit in bits if bit is not None)
    if time_step is not None:
        spec.option.timestep = time_step
    compiled = spec.compile()
    names = tuple(compiled.joint(j).name for j in range(compiled.njnt))
    joints = np.array([i for i, name in enumerate(model.joint_names) if name in names], dtype=np.int64)
    motors = np.array([names.index(model.joint_names[i]) for i in joints], dtype=np.int64)
    drives = [f"{model.joint_names[i]}.drive" for i in joints]
    twists = np.array([names.index(d) if d in names else -1 for d in drives], dtype=np.int64)
    springs = _springs(model, config, names)
    return Plant(compiled, names, joints, motors, twists, springs, _frictions(model, config, joints))


def sensor_site(sensor: ArmSensor) -> str:
    """Name of the site where a sensor on the arm is."""
    return f"sensor.{sensor.name}"


def linearise(plant: Plant, position: np.ndarray) -> PlantLinearisation:
    """Linearisation about a position (d,) at rest: springs in contact, no Coulomb friction; gravity stiffness by central differences."""
    import mujoco

    data = mujoco.MjData(plant.mjmodel)
    d = plant.mjmodel.nv
    gravity = gravity_force(plant, data, position)
    mass = np.empty((d, d))
    for i, unit in enumerate(np.eye(d)):
        mujoco.mj_mulM(plant.mjmodel, data, mass[i], unit)
    damping = np.diag(plant.springs[:, 1].copy())
    damping[plant.motors, plant.motors] += plant.frictions[:, 0]
    stiffness = gravity_stiffness(plant, data, position)
    stiffness[np.diag_indices(d)] += spring_tangent(plant, position)
    return PlantLinearisation(mass, damping, stiffness, gravity)


def gravity_force(plant: Plant, data: mujoco.MjData, position: np.ndarray) -> np.ndarray:
    """Force of gravity (d,) at rest in a position (d,), N m: what the springs and motors must hold."""
    import mujoco

    data.qpos[:] = position
    data.qvel[:] = 0
    mujoco.mj_forward(plant.mjmodel, data)
    return data.qfrc_bias.copy()


def gravity_stiffness(
    plant: Plant, data: mujoco.MjData, position: np.ndarray, step: float = 1e-4
) -> np.ndarray:
    """Derivative (d, d) of `gravity_force`, by fourth-order central differences."""
    columns = []
    for unit in np.eye(len(position)) * step:
        near = gravity_force(plant, data, position + unit) - gravity_force(plant, data, position - unit)
        far = gravity_force(plant, data, position + 2 * unit) - gravity_force(
            plant, data, position - 2 * unit
        )
        columns.append((8 * near - far) / (12 * step))
    return np.array(columns).T


def spring_torque(plant: Plant, position: np.ndarray, flank: np.ndarray) -> np.ndarray:
    """Torque (d,) of every spring against its twist, the gap taken up on the side `flank` (d,) = sign of the torque on the arm."""
    stiffness, _, half_backlash, cubic = plant.springs[:, :4].T
    stretch = position + half_backlash * flank
    return stiffness * stretch * (1 + cubic * stretch**2)


def spring_tangent(plant: Plant, position: np.ndarray) -> np.ndarray:
    """Tangent stiffness (d,) of every spring at a position (d,), in contact."""
    stiffness, _, half_backlash, cubic = plant.springs[:, :4].T
    stretch = np.maximum(np.abs(position) - half_backlash, 0)
    return stiffness * (1 + 3 * cubic * stretch**2)


def _springs(model: RobotModel, config: CellConfig, names: tuple[str, ...]) -> np.ndarray:
    mismatch = config.mismatch
    springs = np.zeros((len(names), 6))
    springs[:, 5] = mismatch.hysteresis_width
    for spring in model.elastic:
        for component in spring.components:
            row = springs[names.index(f"{spring.name}.{('bearing_x', 'bearing_y', 'drive')[component]}")]
            row[:2] = spring.stiffness[component], spring.damping[component]
            if component == 2:
                row[2] = model.drives.backlash[spring.index]
                row[3] = mismatch.cubic_stiffness / TWIST_OF_CUBIC**2
                row[4] = mismatch.hysteresis * spring.stiffness[component]
    rigid = set(range(model.n)) - {e.index for e in model.elastic}
    loose = [model.joint_names[i] for i in rigid if model.drives.backlash[i] > 0]
    if loose:
        raise FlexcalError(
            "E-CELL-025",
            f"{loose[0]} has backlash but no drive spring; the virtual cell needs the spring beside the gap.",
        )
    return springs


def _frictions(model: RobotModel, config: CellConfig, joints: np.ndarray) -> np.ndarray:
    friction = config.friction
    viscous, coulomb = (
        friction.scale * np.nan_to_num(values[joints])
        for values in (model.drives.viscous, model.drives.coulomb)
    )
    one = np.ones(len(joints))
    columns = (
        viscous,
        coulomb,
        one * friction.coulomb_velocity,
        friction.stribeck * coulomb,
        one * friction.stribeck_velocity,
    )
    return np.column_stack(columns)


def unresolved(plant: Plant) -> str | None:
    """Modes too fast for the plant's time step, as a phrase; None if it is stable with motors sliding and sticking."""
    linear = linearise(plant, np.zeros(plant.mjmodel.nv))
    step, springs = plant.mjmodel.opt.timestep, plant.springs[:, 0]
    sticking = linear.damping.copy()
    sticking[plant.motors, plant.motors] += (plant.frictions[:, 1] + plant.frictions[:, 3]) / plant.frictions[
        :, 2
    ]
    if growth_rate(linear.mass, linear.damping, linear.stiffness, springs, step) > FALLING:
        return "the robot's fastest modes"
    if growth_rate(linear.mass, sticking, linear.stiffness, springs, step) > FALLING:
        return "the motors' Coulomb friction near standstill"
    return None
