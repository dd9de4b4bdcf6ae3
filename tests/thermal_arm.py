"""An arm that grows with its temperature: Denavit-Hartenberg rows scaled each by its own link's temperature, and a sensor that lags."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from dh_arm import DHArm

COLD = 20.0
"""Temperature, °C, at which an arm has its rows."""


@dataclass(frozen=True)
class ThermalArm:
    """Arm whose link k has the temperature COLD + gradient_k ΔT, expansion (6,), 1/K, and drifts of joint zeros (6,), rad/K."""

    arm: DHArm
    expansion: np.ndarray = field(default_factory=lambda: np.full(6, 15e-6))
    drift: np.ndarray = field(default_factory=lambda: np.zeros(6))
    gradient: np.ndarray = field(default_factory=lambda: np.ones(6))

    def points(self, q: np.ndarray, temperature: np.ndarray) -> np.ndarray:
        """The reflector (N, 3) in the base frame, at the temperatures (N,) of the warmest link, °C."""
        found = np.empty((len(q), 3))
        for k, (row, warm) in enumerate(zip(q, temperature, strict=True)):
            rise = self.gradient * (warm - COLD)
            rows = self.arm.rows.copy()
            rows[:, 1:3] *= (1 + self.expansion * rise)[:, None]
            rows[:, 0] += self.drift * rise
            tool = self.arm.tool * (1 + self.expansion[5] * rise[5])
            found[k] = replace(self.arm, rows=rows, tool=tool).points(row[None])[0]
        return found


def warming(time: np.ndarray, rise: float = 12.0, constant: float = 2400.0) -> np.ndarray:
    """Temperatures of an arm that warms up, °C, `time` in s."""
    return COLD + rise * (1 - np.exp(-time / constant))


def cycling(time: np.ndarray, rise: float = 12.0, period: float = 5400.0) -> np.ndarray:
    """Temperatures of an arm that warms up and cools down again, and so on."""
    return COLD + rise * (1 - np.cos(2 * np.pi * time / period)) / 2


def sensed(
    time: np.ndarray,
    temperature: np.ndarray,
    rng: np.random.Generator,
    *,
    noise: float = 0.3,
    lag: float = 0.0,
) -> np.ndarray:
    """Readings of a sensor with noise, K (1σ), that follows the arm with a time constant `lag`, s."""
    read = temperature.copy()
    if lag > 0:
        for k in range(1, len(time)):
            share = np.exp(-(time[k] - time[k - 1]) / lag)
            read[k] = share * read[k - 1] + (1 - share) * temperature[k]
    return read + noise * rng.standard_normal(len(time))


def write_warm_poses(
    path: Path,
    q: np.ndarray,
    xyz: np.ndarray,
    sigma: float,
    temperature: np.ndarray | None = None,
    time: np.ndarray | None = None,
) -> Path:
    """A file of measured poses with temperatures, °C, and times, s."""
    columns = [("pose", np.arange(len(q)))] + [(f"q{k}", q[:, k - 1]) for k in range(1, 7)]
    columns += [(name, xyz[:, k]) for k, name in enumerate("xyz")] + [("sigma", np.full(len(q), sigma))]
    columns += [] if temperature is None else [("temperature", temperature)]
    columns += [] if time is None else [("t", time)]
    lines = [",".join(name for name, _ in columns)]
    lines += [
        ",".join(map(repr, row)) for row in zip(*(values.tolist() for _, values in columns), strict=True)
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
