"""Linear elastic arms in numpy alone, by energies: potential and masses by differences of the positions of the links' centres of mass.

An arm is read from a URDF and a robot.yaml by a reader of its own; responses are s² F (M s² + D s + K)⁻¹ B with noise on the torques.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from flexcal.frequency.periodic import FrequencyResponse
from flexcal.frequency.periodic.covariance import total_covariance

GRAVITY = 9.81
STEP = 1e-4


def turned(axis: int, angle: float) -> np.ndarray:
    """Rotation matrix about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def roll_pitch_yaw(angles) -> np.ndarray:
    """Rotation matrix of URDF's rpy."""
    return turned(2, angles[2]) @ turned(1, angles[1]) @ turned(0, angles[0])


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix about a unit vector (Rodrigues)."""
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def part(element: ET.Element, name: str) -> ET.Element:
    """A child that every URDF has."""
    found = element.find(name)
    assert found is not None
    return found


def _stretched(tensor: np.ndarray, size: float, rng: np.random.Generator) -> np.ndarray:
    """The inertia of a body whose second moments along its principal axes are off, so that it still is one of a body."""
    if size == 0:
        return tensor
    second = np.trace(tensor) / 2 * np.eye(3) - tensor
    moments, axes = np.linalg.eigh(second)
    second = axes @ np.diag(np.maximum(moments, 0) * np.exp(size * rng.standard_normal(3))) @ axes.T
    return np.trace(second) * np.eye(3) - second


@dataclass(frozen=True)
class Arm:
    """Numbers of an arm; n joints, of which the first e have rotor, drive and two bearings: `springs`, `dampers` (e, 3) about x, y, z.

    `gain` (e,) is the true torque of a motor over that of the log.
    """

    joints: tuple[str, ...]
    links: tuple[str, ...]
    places: tuple[np.ndarray, ...]
    turns: tuple[np.ndarray, ...]
    axes: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    rotor: np.ndarray
    viscous: np.ndarray
    springs: np.ndarray
    dampers: np.ndarray
    frames: tuple[np.ndarray, ...]
    flange: tuple[np.ndarray, np.ndarray]
    held: float
    held_com: np.ndarray
    gain: np.ndarray

    @property
    def elastic(self) -> int:
        """Number of elastic joints."""
        return len(self.springs)

    @classmethod
    def read(cls, robot_file: Path) -> Arm:
        """The arm of a robot.yaml whose first joints are all that is elastic."""
        config = yaml.safe_load(robot_file.read_text())
        tree = ET.parse(robot_file.parent / config["robot"]).getroot()
        joints = [j for j in tree.findall("joint") if j.get("type") == "revolute"]
        fixed = {
            part(j, "child").attrib["link"]: j for j in tree.findall("joint") if j.get("type") == "fixed"
        }
        names = [part(j, "child").attrib["link"] for j in joints]
        every = {link.attrib["name"]: link for link in tree.findall("link")}
        bodies = {name: part(every[name], "inertial") for name in names}

        def numbers(element, key, default="0 0 0"):
            return np.array(element.get(key, default).split(), dtype=float)

        place = [numbers(part(j, "origin"), "xyz") for j in joints]
        turn = [roll_pitch_yaw(numbers(part(j, "origin"), "rpy")) for j in joints]
        tensors = []
        for name in names:
            t = {k: float(v) for k, v in part(bodies[name], "inertia").items()}
            tensor = [
                [t["ixx"], t["ixy"], t["ixz"]],
                [t["ixy"], t["iyy"], t["iyz"]],
                [t["ixz"], t["iyz"], t["izz"]],
            ]
            own = roll_pitch_yaw(numbers(part(bodies[name], "origin"), "rpy"))
            tensors.append(own @ np.array(tensor) @ own.T)
        payload = config["payload"]
        origin = part(fixed[payload["frame"]], "origin")
        springs = [
            [[float(e[k][what]) for k in ("bearing_x", "bearing_y", "drive")] for e in config["elastic"]]
            for what in ("stiffness", "damping")
        ]
        count = len(config["elastic"])
        return cls(
            joints=tuple(j.attrib["name"] for j in joints),
            links=tuple(names),
            places=tuple(place),
            turns=tuple(turn),
            axes=np.array([numbers(part(j, "axis"), "xyz") for j in joints]),
            mass=np.array([float(part(bodies[n], "mass").attrib["value"]) for n in names]),
            com=np.array([numbers(part(bodies[n], "origin"), "xyz") for n in names]),
            inertia=np.array(tensors),
            rotor=np.array(config["drives"]["rotor_inertia"][:count], dtype=float),
            viscous=np.array(config["drives"]["viscous"][:count], dtype=float),
            springs=np.array(springs[0]),
            dampers=np.array(springs[1]),
            frames=tuple(roll_pitch_yaw(e["frame_rpy"]) for e in config["elastic"]),
            flange=(numbers(origin, "xyz"), roll_pitch_yaw(numbers(origin, "rpy"))),
            held=float(payload["mass"]),
            held_com=np.array(payload["com"], dtype=float),
            gain=np.ones(count),
        )

    def bodies(self, z: np.ndarray, wrist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Centres of mass (n + 1, 3), the payload last, and orientations (n, 3, 3) for the tilts and angles z (e, 3) and held joints."""
        place, turn = np.zeros(3), np.eye(3)
        centres, turns = [], []
        for k in range(len(self.joints)):
            place, turn = place + turn @ self.places[k], turn @ self.turns[k]
            if k < self.elastic:
                x, y, angle = z[k]
                frame = self.frames[k]
                turn = turn @ frame @ turned(2, angle) @ turned(1, y) @ turned(0, x) @ frame.T
            else:
                turn = turn @ about(self.axes[k], wrist[k - self.elastic])
            centres.append(place + turn @ self.com[k])
            turns.append(turn)
        at = place + turn @ self.flange[0]
        centres.append(at + turn @ self.flange[1] @ self.held_com)
        return np.array(centres), np.array(turns)

    def system(self, q: np.ndarray, viscous: np.ndarray, held: float | None = None):
        """M, D, K ((4 e, 4 e)) of e rotors followed by (x, y, angle) of every elastic joint, at rest with the motors at q."""
        e, wrist = self.elastic, q[self.elastic :]
        masses = np.append(self.mass, self.held if held is None else held)

        def potential(z):
            return GRAVITY * float(masses @ self.bodies(z.reshape(e, 3), wrist)[0][:, 2])

        steps = STEP * np.eye(3 * e)
        rest = np.column_stack([np.zeros((e, 2)), q[:e]]).ravel()
        z, springs = rest.copy(), self.springs.ravel()
        for _ in range(20):
            gravity = np.array([(potential(z + d) - potential(z - d)) / (2 * STEP) for d in steps])
            move = (gravity + springs * (z - rest)) / springs
            z = z - move
            if np.abs(move).max() < 1e-12:
                break
        bent = np.array(
            [
                [
                    (
                        potential(z + a + b)
                        - potential(z + a - b)
                        - potential(z - a + b)
                        + potential(z - a - b)
                    )
                    / (4 * STEP**2)
                    for b in steps
                ]
                for a in steps
            ]
        )
        ahead = [self.bodies((z + d).reshape(e, 3), wrist) for d in steps]
        behind = [self.bodies((z - d).reshape(e, 3), wrist) for d in steps]
        turns = self.bodies(z.reshape(e, 3), wrist)[1]
        moved = np.array([(a[0] - b[0]) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)])
        spun = np.array([(a[1] - b[1]) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)])
        skew = np.swapaxes(turns, 1, 2) @ spun
        rates = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
        links = np.einsum("ikc,k,jkc->ij", moved, masses, moved)
        links += np.einsum("ika,kab,jkb->ij", rates, self.inertia, rates)
        mass, damp, stiff = (np.zeros((4 * e, 4 * e)) for _ in range(3))
        mass[:e, :e], mass[e:, e:] = np.diag(self.rotor), links
        stiff[e:, e:] = bent
        damp[range(e), range(e)] = viscous
        for k in range(e):
            for c in range(3):
                edge = np.eye(4 * e)[e + 3 * k + c] - (np.eye(4 * e)[k] if c == 2 else 0.0)
                stiff += self.springs[k, c] * np.outer(edge, edge)
                damp += self.dampers[k, c] * np.outer(edge, edge)
        return mass, damp, stiff

    def response(
        self, q: np.ndarray, frequencies_hz: np.ndarray, viscous: np.ndarray, held: float | None = None
    ) -> np.ndarray:
        """Motor accelerations by the log's torques (L, e, e)."""
        mass, damp, stiff = self.system(q, viscous, held)
        e = self.elastic
        s = 2j * np.pi * frequencies_hz[:, None, None]
        moved = np.linalg.solve(
            mass * s**2 + damp * s + stiff,
            np.broadcast_to(np.eye(4 * e)[:, :e], (len(s), 4 * e, e)).astype(complex),
        )
        return (s**2 * moved)[:, :e] * self.gain

    def drawn(
        self, rng: np.random.Generator, *, mass=0.07, com=0.010, rotor=0.05, held=0.02, gain=0.0, tensor=0.0
    ) -> Arm:
        """An arm whose springs are 15 % and dampers 30 % off, and the rest as far as said; tensors go with their masses, and their second
        moments are off by `tensor` (of the logarithm) besides.
        """
        normal = rng.standard_normal
        heavier = np.exp(mass * normal(len(self.mass)))
        return replace(
            self,
            springs=self.springs * np.exp(0.15 * normal(self.springs.shape)),
            dampers=self.dampers * np.exp(0.3 * normal(self.springs.shape)),
            mass=self.mass * heavier,
            inertia=np.array([_stretched(own, tensor, rng) for own in self.inertia]) * heavier[:, None, None],
            com=self.com + com * normal(self.com.shape),
            rotor=self.rotor * np.exp(rotor * normal(len(self.rotor))),
            held=self.held + held * normal(),
            gain=np.exp(gain * normal(len(self.gain))),
        )

    def truth(self) -> dict[str, float]:
        """Stiffness and damping by name."""
        found = {}
        for k in range(self.elastic):
            for c, name in enumerate(("bearing_x", "bearing_y", "drive")):
                found[f"{self.joints[k]}.{name}.stiffness"] = float(self.springs[k, c])
                found[f"{self.joints[k]}.{name}.damping"] = float(self.dampers[k, c])
        return found

    def measured(
        self,
        poses: np.ndarray,
        rng: np.random.Generator,
        *,
        noise: float = 0.05,
        empty: bool = False,
        frequencies_hz: np.ndarray | None = None,
        realisations: int = 4,
        pooled: int = 15,
    ) -> list[FrequencyResponse]:
        """Responses in some poses, with the covariance that the scatter of their realisations tells.

        `noise` is the relative standard deviation of the torques in one realisation, common friction on each motor; `empty` hands.
        """
        lines = np.arange(13, 320, 8) * 0.25 if frequencies_hz is None else frequencies_hz
        e, found = self.elastic, []
        for number, q in enumerate(poses):
            loss = self.viscous * (1.5 + 0.2 * rng.uniform(-1, 1, e))
            exact = self.response(q, lines, loss, 0.0 if empty else None)
            draw = rng.standard_normal((2, realisations, len(lines), e, e)) / np.sqrt(2)
            each = exact + noise * exact @ (draw[0] + 1j * draw[1])
            mean = each.mean(axis=0)
            floor = np.zeros((len(lines), e, e), complex)
            floor[:, range(e), range(e)] = (1e-4 * np.abs(mean[:, range(e), range(e)])) ** 2
            unit = np.broadcast_to(np.eye(e, dtype=complex), (len(lines), e, e))
            covariance, freedom = total_covariance(each, mean, floor, unit, pooled)
            found.append(
                FrequencyResponse(
                    frequencies_hz=lines,
                    response=mean,
                    covariance=covariance,
                    noise_covariance=covariance,
                    degrees_of_freedom=freedom,
                    realisations=each,
                    joints=self.joints[:e],
                    q_mean=np.asarray(q, dtype=float),
                    payload=0.0 if empty else None,
                    pose=number,
                    sample_time=1 / 4000,
                )
            )
        return found
