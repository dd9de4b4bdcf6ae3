"""The two arms of `stranger_torso`, of which the right one's tip touches a ball in the left hand; shares nothing with flexcal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from stranger_torso import StrangerTorso

RADIUS = 0.0225
DECLARED = np.array([0.02, 0.06, -0.05])
"""Where robot.yaml has the ball, m, in the axes of the left hand."""


class TouchingArms(StrangerTorso):
    """Arms whose ball is some millimetres off its declared place."""

    @property
    def ball(self) -> np.ndarray:
        """Centre of the ball (3,), m, in the axes of the left hand."""
        return DECLARED + 4e-3 * np.random.default_rng([self.seed, 5]).normal(size=3)

    def ball_at(self, q: np.ndarray) -> np.ndarray:
        """Centre of the ball (N, 3) in the base frame."""
        rotation, position = self.tool(q, "left", true=True)
        return position + rotation @ self.ball

    def touches(self, count: int, rng: np.random.Generator, noise: float = 2e-5) -> np.ndarray:
        """Joint positions (count, n) with the tip on the ball, anywhere on it, off by `noise`, m, along the normal."""
        mine = [k for k, link in enumerate(self.links) if link.name.startswith("right")]
        found = np.empty((0, self.n))
        while len(found) < count:
            q = self.postures(2 * count, rng)
            reached = RADIUS + noise * rng.normal(size=len(q))
            side = rng.normal(size=(len(q), 3))
            side /= np.linalg.norm(side, axis=1)[:, None]
            for _ in range(15):
                miss = self.ball_at(q) + reached[:, None] * side - self.reflector(q, "right")
                columns = np.empty((len(q), 3, len(mine)))
                for k, joint in enumerate(mine):
                    step = q.copy()
                    step[:, joint] += 1e-6
                    columns[:, :, k] = (self.reflector(step, "right") - self.reflector(q, "right")) / 1e-6
                square = columns @ np.swapaxes(columns, 1, 2) + 1e-8 * np.eye(3)
                step = np.swapaxes(columns, 1, 2) @ np.linalg.solve(square, miss[:, :, None])
                q[:, mine] += np.clip(step[:, :, 0], -0.3, 0.3)
            away = np.linalg.norm(self.ball_at(q) - self.reflector(q, "right"), axis=1)
            good = (np.abs(away - reached) < 1e-9) & (np.abs(q).max(axis=1) < 2.4)
            found = np.vstack([found, q[good]])
        return found[:count]

    def write_touches(self, path: Path, count: int, rng: np.random.Generator) -> Path:
        """Contacts of the right tip with `ball`."""
        lines = [",".join([*(f"q{i + 1}" for i in range(self.n)), "target", "touched"])]
        lines += [",".join([*map(repr, q.tolist()), "right", "ball"]) for q in self.touches(count, rng)]
        path.write_text("\n".join(lines) + "\n")
        return path
