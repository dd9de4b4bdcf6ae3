"""True parameters of the hard cell's robot, drawn about its description."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from flexcal.hard_cell.description import ArmDescription, Link

MASS, COM = 0.07, 0.010  # relative; m
INERTIA, INERTIA_TURN = 0.15, 0.08  # of the logarithm of a second moment; rad
ROTOR, TORQUE_CONSTANT = 0.02, 0.02  # relative
LENGTH, ANGLE = 3e-4, 5e-4  # m, rad: placement of every joint in its parent
STIFFNESS, DAMPING, FRICTION = 0.15, 0.3, 0.25  # of the logarithm
RULER = 5e-4  # m: the reflector in its frame
PAYLOAD_COM, PAYLOAD_RADIUS = 2e-3, 0.05  # m
WRIST, WRIST_DAMPING = (50e3, 200e3), 3e-4  # N m/rad; s: damping over stiffness
GAP = (2e-5, 5e-5)  # rad, half
HARDENING = 0.2  # relative, at most, at HARDENING_TWIST
HARDENING_TWIST = 1e-3  # rad
HYSTERESIS = (1.5e-5, 1.45e-4)  # rad, half width of the loop: full 0.1 to 1 arc minute (Nabtesco)
SLIP_SHARE = (0.1, 0.5)  # stiffness of the slipping element over that of the drive
JOINT_ERROR, MOTOR_ERROR = 6e-5, 2e-5  # rad, at most: transmission error, harmonic 1; half of it harmonic 2
REPEATABILITY = (3e-5, 1e-4)  # m: root mean square distance of visits to a pose from their mean
SIGMA_FACTOR = (0.2, 5.0)  # stated over true standard deviation of the tracker
WARMING, EXPANSION = 6.0, 2.3e-5  # K at most, 1/K (aluminium)


@dataclass(frozen=True, eq=False)
class HardRobot:
    """True parameters of an arm; n joints, SI, at the joint.

    `bearings_before`: the bearing's axes are fixed to the parent, before the joint's rotation; else they turn with it. `hardening` (n,
    3) 1/rad²; `hysteresis` (n,) half width of the drive's loop, rad, `slip_twist` (n,) the twist at which its element slips; `backlash`
    (n,) half, rad; `stribeck`, `stribeck_velocity`, `per_load`, `bristle` (rad) of friction; `error_amplitude`, `error_phase` (n, 4) of
    the gear; `torque_gain` (n,) true over believed torque; `joint_scatter` (n,) rad and `point_scatter` m an axis of every visit, 1σ;
    `expansion` (links,) relative, at the end of a measurement; `payload_excess` kg beyond what is declared; `sigma_factor` stated over
    true tracker sigma; `station` its frame's rotation (3, 3) and place.
    """

    arm: ArmDescription
    bearings_before: bool
    hardening: np.ndarray
    hysteresis: np.ndarray
    slip_twist: np.ndarray
    backlash: np.ndarray
    stribeck: np.ndarray
    stribeck_velocity: np.ndarray
    per_load: np.ndarray
    bristle: np.ndarray
    error_amplitude: np.ndarray
    error_phase: np.ndarray
    torque_gain: np.ndarray
    repeatability: float
    joint_scatter: np.ndarray
    point_scatter: float
    expansion: np.ndarray
    payload_excess: float
    sigma_factor: float
    station: tuple[np.ndarray, np.ndarray]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.backlash)

    def carried(self, declared: float) -> float:
        """Mass, kg, that the arm truly holds where `declared` kg are said."""
        return declared + self.payload_excess if declared > 0 else 0.0


def ideal_robot(arm: ArmDescription, *, bearings_before: bool = True) -> HardRobot:
    """An arm exactly as described, measured without noise."""
    n, zero = len(arm.joints), np.zeros(len(arm.joints))
    return HardRobot(
        arm=arm,
        bearings_before=bearings_before,
        hardening=np.zeros((n, 3)),
        hysteresis=zero,
        slip_twist=np.full(n, 1e-4),
        backlash=zero,
        stribeck=zero,
        stribeck_velocity=np.ones(n),
        per_load=zero,
        bristle=np.full(n, 1e-4),
        error_amplitude=np.zeros((n, 4)),
        error_phase=np.zeros((n, 4)),
        torque_gain=np.ones(n),
        repeatability=0.0,
        joint_scatter=zero,
        point_scatter=0.0,
        expansion=np.zeros(len(arm.links)),
        payload_excess=0.0,
        sigma_factor=1.0,
        station=(np.eye(3), np.zeros(3)),
    )


def draw_robot(described: ArmDescription, rng: np.random.Generator) -> HardRobot:
    """A true robot around a description; its bearings are fixed to the parent in every second robot, on average."""
    n = len(described.joints)
    uniform, normal = rng.uniform, rng.standard_normal
    springs = described.springs * np.exp(STIFFNESS * normal((n, 3)))
    dampers = described.dampers * np.exp(DAMPING * normal((n, 3)))
    wrist = ~np.isfinite(springs[:, 2])
    springs[wrist, 2] = np.exp(uniform(np.log(WRIST[0]), np.log(WRIST[1]), int(wrist.sum())))
    dampers[wrist, 2] = WRIST_DAMPING * springs[wrist, 2]
    name, link, place = described.point
    com = described.held_com
    arm = replace(
        described,
        links=tuple(_draw_link(k, rng) for k in described.links),
        springs=springs,
        dampers=dampers,
        rotor_inertia=described.rotor_inertia * (1 + ROTOR * normal(n)),
        viscous=described.viscous * np.exp(FRICTION * normal(n)),
        coulomb=described.coulomb * np.exp(FRICTION * normal(n)),
        point=(name, link, place + RULER * normal(3)),
        held_com=None if com is None else com + PAYLOAD_COM * normal(3),
    )
    backlash = np.zeros(n)
    backlash[list(arm.backlash_joints)] = uniform(*GAP, len(arm.backlash_joints))
    repeatability = float(uniform(*REPEATABILITY))
    amplitude = np.column_stack([uniform(0, JOINT_ERROR, (n, 2)), uniform(0, MOTOR_ERROR, (n, 2))]) * [
        1,
        0.5,
        1,
        0.5,
    ]
    turn = Rotation.from_rotvec([0, 0, uniform(-np.pi, np.pi)]) * Rotation.from_rotvec(0.02 * normal(3))
    stand = arm.station[1] + 0.2 * normal(3)
    return HardRobot(
        arm=arm,
        bearings_before=bool(rng.integers(2)),
        hardening=np.column_stack([np.zeros((n, 2)), uniform(0, HARDENING, n)]) / HARDENING_TWIST**2,
        hysteresis=(half_width := np.exp(uniform(np.log(HYSTERESIS[0]), np.log(HYSTERESIS[1]), n))),
        backlash=backlash,
        stribeck=arm.coulomb * uniform(0, 0.4, n),
        stribeck_velocity=uniform(0.02, 0.1, n),
        per_load=uniform(0, 0.03, n),
        bristle=uniform(2e-5, 1e-4, n),
        error_amplitude=amplitude,
        error_phase=uniform(0, 2 * np.pi, (n, 4)),
        torque_gain=1 + TORQUE_CONSTANT * normal(n),
        repeatability=repeatability,
        joint_scatter=_joint_scatter(arm, repeatability / np.sqrt(2)),
        point_scatter=repeatability / np.sqrt(6),
        expansion=EXPANSION * uniform(0, WARMING) * uniform(0, 1, len(arm.links)),
        payload_excess=float(arm.payload_std * normal()),
        sigma_factor=float(np.exp(uniform(*np.log(SIGMA_FACTOR)))),
        station=(turn.as_matrix(), stand),
        slip_twist=half_width / uniform(*SLIP_SHARE, n),
    )


def _joint_scatter(arm: ArmDescription, distance: float) -> np.ndarray:
    """The angle (n,), alike at all joints, by which they scatter so that together they move the outstretched tool by `distance` (m)."""
    steps = [float(np.linalg.norm(link.translation)) for link in arm.links]
    beyond = [sum(steps[k + 1 :]) + float(np.linalg.norm(arm.point[2])) for k in arm.joints]
    return np.full(len(beyond), distance / np.linalg.norm(beyond))


def _draw_link(link: Link, rng: np.random.Generator) -> Link:
    """A link whose shape errs independently of its mass: principal second moments and axes are drawn, so a body with them exists."""
    normal = rng.standard_normal
    rotation, translation = link.rotation, link.translation
    if link.axis is not None:
        rotation = Rotation.from_rotvec(ANGLE * normal(3)).as_matrix() @ rotation
        translation = translation + LENGTH * normal(3)
    if link.mass == 0:
        return replace(link, rotation=rotation, translation=translation)
    second = np.trace(link.inertia) / 2 * np.eye(3) - link.inertia
    moments, axes = np.linalg.eigh(second)
    axes = Rotation.from_rotvec(INERTIA_TURN * normal(3)).as_matrix() @ axes
    moments = np.maximum(moments, 1e-3 * moments.max()) * np.exp(INERTIA * normal(3))
    second = axes @ np.diag(moments) @ axes.T
    return replace(
        link,
        rotation=rotation,
        translation=translation,
        mass=link.mass * max(1 + MASS * normal(), 0.5),
        com=link.com + COM * normal(3),
        inertia=np.trace(second) * np.eye(3) - second,
    )


MILLIRADIAN = 1e-3
_SPRINGS = ("bearing_x", "bearing_y", "drive")


def counterparts(robot: HardRobot) -> dict[str, float]:
    """True values, SI, of link masses and centres of mass, rotor inertias, springs, dampers, hardening and half gaps, by parameter name.

    Springs of the wrist are among them, which stage 1 may find. The rest of the robot, above all its geometry, has other parameters than
    the model and can be judged by measured points alone.
    """
    arm, values = robot.arm, {}
    for j, k in enumerate(arm.joints):
        link = arm.links[k]
        values[f"{link.name}.mass"] = link.mass
        values |= {f"{link.name}.com_{axis}": float(x) for axis, x in zip("xyz", link.com, strict=True)}
        values[f"{link.joint}.rotor_inertia"] = float(arm.rotor_inertia[j])
        for component in np.flatnonzero(np.isfinite(arm.springs[j])):
            values[f"{link.joint}.{_SPRINGS[component]}.stiffness"] = float(arm.springs[j, component])
            values[f"{link.joint}.{_SPRINGS[component]}.damping"] = float(arm.dampers[j, component])
        if np.isfinite(arm.springs[j, 2]):
            values[f"{link.joint}.drive.hardening"] = float(robot.hardening[j, 2]) * MILLIRADIAN**2
        if j in arm.backlash_joints:
            values[f"{link.joint}.backlash"] = float(robot.backlash[j])
    return values
