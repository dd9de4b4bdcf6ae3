"""A Fanuc LR Mate 200iD by its published dimensions, in the maker's own convention, its URDF, and an interpreter of its TP programs."""

from __future__ import annotations

import re

import numpy as np

LENGTHS = np.array([0.050, 0.330, 0.035, 0.335, 0.080])
"""Axis 1 to 2, lower arm, elbow offset, forearm, wrist to faceplate, m; the world frame lies on axis 1 at the height of axis 2."""


def about(axis: int, angle: float) -> np.ndarray:
    """Homogeneous rotation about x, y or z."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    turn = np.eye(4)
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def shifted(x: float, y: float, z: float) -> np.ndarray:
    """Homogeneous translation."""
    at = np.eye(4)
    at[:3, 3] = x, y, z
    return at


FACEPLATE = about(1, -np.pi / 2) @ about(0, np.pi)
"""Orientation of the faceplate's frame where all joints are zero: W 180, P -90, R 0."""


def pose(numbers: np.ndarray) -> np.ndarray:
    """Matrix of X, Y, Z in mm and W, P, R in degrees."""
    w, p, r = np.radians(numbers[3:])
    return shifted(*(numbers[:3] / 1e3)) @ about(2, r) @ about(1, p) @ about(0, w)


def numbers_of(at: np.ndarray) -> np.ndarray:
    """X, Y, Z in mm and W, P, R in degrees of a matrix."""
    turn = at[:3, :3]
    wpr = [
        np.arctan2(turn[2, 1], turn[2, 2]),
        np.arcsin(np.clip(-turn[2, 0], -1, 1)),
        np.arctan2(turn[1, 0], turn[0, 0]),
    ]
    return np.concatenate([at[:3, 3] * 1e3, np.degrees(wpr)])


class LrMate:
    """An LR Mate; `zero` (6,) rad are errors of its encoders, `tilts` (5, 2) rad and `away` (5, 3) m of what lies between its axes."""

    def __init__(
        self, zero: np.ndarray | None = None, tilts: np.ndarray | None = None, away: np.ndarray | None = None
    ) -> None:
        self.zero = np.zeros(6) if zero is None else zero
        self.tilts = np.zeros((5, 2)) if tilts is None else tilts
        self.away = np.zeros((5, 3)) if away is None else away

    def flange(self, joints: np.ndarray) -> np.ndarray:
        """Faceplate in the world frame at J1 … J6 in degrees as the pendant shows them: J3 counts from the horizontal."""
        shown = np.radians(joints)
        q = shown + self.zero
        q[2] = shown[2] + shown[1] + self.zero[2]  # the elbow's own angle
        a, b, c, d, e = LENGTHS
        steps = [
            about(2, q[0]) @ shifted(a, 0, 0),
            about(1, q[1]) @ shifted(0, 0, b),
            about(1, -q[2]) @ shifted(d, 0, c),
            about(0, -q[3]),
            about(1, -q[4]) @ shifted(e, 0, 0),
        ]
        at = np.eye(4)
        for step, (one, other), away in zip(steps, self.tilts, self.away, strict=True):
            at = at @ step @ shifted(*away) @ about(0, one) @ about(2, other)
        return at @ about(0, -q[5]) @ FACEPLATE

    def config(self, joints: np.ndarray) -> str:
        """Letters of the configuration: flip of the wrist, elbow, front or back."""
        j2, j3 = np.radians(joints[1:3])
        a, b, c, d, _ = LENGTHS
        elbow = b * np.array([np.sin(j2), np.cos(j2)])
        wrist = elbow + np.array([d * np.cos(j3) - c * np.sin(j3), d * np.sin(j3) + c * np.cos(j3)])
        up = elbow[1] * wrist[0] - elbow[0] * wrist[1] > 0
        return f"{'F' if joints[4] >= 0 else 'N'} {'U' if up else 'D'} {'T' if a + wrist[0] > 0 else 'B'}"

    def joints(self, flange: np.ndarray, config: str, near: np.ndarray) -> np.ndarray:
        """Joints in degrees at a pose with a configuration, by Newton's method from postures all over, the nearest to others first."""
        rng = np.random.default_rng(0)
        flipped = near * [1, 1, 1, 1, -1, 1]
        starts = [
            each + rng.uniform(-wide, wide, 6) for wide in np.linspace(0, 90, 40) for each in (near, flipped)
        ]
        for start in starts:
            q = np.array(start, dtype=float)
            for _ in range(60):
                now = self._off(flange, q)
                if np.abs(now).max() < 1e-12:
                    break
                slope = np.array(
                    [(self._off(flange, q + e) - self._off(flange, q - e)) / 2e-4 for e in 1e-4 * np.eye(6)]
                )
                step = -np.linalg.lstsq(slope.T, now, rcond=None)[0]
                q = q + step * min(1.0, 20 / np.abs(step).max())
            if np.abs(self._off(flange, q)).max() < 1e-10:
                q = (q + 180) % 360 - 180
                if self.config(q) == config:
                    return q
        raise AssertionError("the pose has no such posture")

    def _off(self, flange: np.ndarray, q: np.ndarray) -> np.ndarray:
        at = self.flange(q)
        turn = flange[:3, :3] @ at[:3, :3].T
        axis = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        return np.concatenate([flange[:3, 3] - at[:3, 3], np.array(axis) / 2])


def true_arm(seed: int) -> LrMate:
    """Errors of 0.5 mrad and 0.3 mm, but none about and along axes 1 and 6, which the base and the tool have as well."""
    rng = np.random.default_rng(seed)
    zero = rng.normal(0, 5e-4, 6)
    zero[[0, 5]] = 0.0
    tilts, away = rng.normal(0, 5e-4, (5, 2)), rng.normal(0, 3e-4, (5, 3))
    tilts[4, 0] = away[4, 0] = 0.0
    return LrMate(zero, tilts, away)


def urdf_text() -> str:
    """URDF as ROS-Industrial writes it: axes of the maker's signs, joint 3 relative to the lower arm, frames base and tool0."""
    places = ["0 0 0.33", "0.05 0 0", "0 0 0.33", "0 0 0.035", "0.335 0 0", "0.08 0 0"]
    axes = ["0 0 1", "0 1 0", "0 -1 0", "-1 0 0", "0 -1 0", "-1 0 0"]
    limits = [(-3.0, 3.0), (-1.75, 2.5), (-2.4, 4.8), (-3.3, 3.3), (-2.18, 2.18), (-6.28, 6.28)]
    links = "".join(f'<link name="link_{k}"/>' for k in range(1, 7))
    joints = "".join(
        f'<joint name="joint_{k}" type="revolute"><parent link="{"base_link" if k == 1 else f"link_{k - 1}"}"/><child link="link_{k}"/>'
        f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="50" velocity="5"/></joint>\n'
        for k, (place, axis, (low, high)) in enumerate(zip(places, axes, limits, strict=True), 1)
    )
    fixed = (
        '<link name="base"/><joint name="base_link-base" type="fixed"><parent link="base_link"/>'
        '<child link="base"/><origin xyz="0 0 0.33"/></joint>'
        '<link name="tool0"/><joint name="link_6-tool0" type="fixed"><parent link="link_6"/><child link="tool0"/>'
        '<origin xyz="0 0 0" rpy="3.141592653589793 -1.5707963267948966 0"/></joint>'
    )
    return f'<robot name="lrmate"><link name="base_link"/>{links}{joints}{fixed}</robot>'


def moved(
    text: str, arm: LrMate, tools: dict[int, np.ndarray], frames: dict[int, np.ndarray], near: np.ndarray
) -> list[np.ndarray]:
    """Joints in degrees at the motions J, L, C to P[…] without offsets, in the order of a program, as the controller of `arm` has them."""
    _, rest = text.replace("\r", "").split("/MN\n")
    lines, places = rest.split("/POS\n")
    known = {}
    for number, body in re.findall(r"P\[(\d+)[^\]]*\]\{\n   GP1:\n(.*?)\n(?:   GP2|\})", places, re.DOTALL):
        frame, tool = (int(re.findall(rf"{key} : (\d+)", body)[0]) for key in ("UF", "UT"))
        values = {key: float(value) for key, value in re.findall(r"([XYZWPR]|J\d) ?=\s*(-?[\d.]+)", body)}
        config = re.search(r"CONFIG : '(. . .)", body)
        known[number] = (frame, tool, values, config and config[1])
    stops = []
    for line in lines.splitlines():
        if "ffset" in line or not re.match(r"\s*\d*:([JLC]|  )\s*P\[", line):
            continue
        for number in re.findall(r"(?<![\w])P\[(\d+)", line):
            frame, tool, values, config = known[number]
            if config is None:
                near = np.array([values[f"J{k}"] for k in range(1, 7)])
            else:
                goal = (
                    frames[frame]
                    @ pose(np.array([values[key] for key in "XYZWPR"]))
                    @ np.linalg.inv(tools[tool])
                )
                near = arm.joints(goal, config, near)
            stops.append(near)
    return stops
