"""Calibrations of a real UR5 on one part of its grid of poses, verified on the rest: `python -m benchmarks.transfer`.

Parts are halves by every coordinate of the point and every joint, the fifth nearest to the middle, and a corner; of each all poses, and 60.
P90 and the inside error, at poses of the same part left out, are told as ratios to a calibration of the geometry alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.few_poses import observed_over_predicted
from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.verification import prediction_errors
from flexcal.data.poses import PoseSet

EXAMPLE = Path(__file__).parents[1] / "examples" / "ur5_tracker"
_SHARE = 2 / 3
"""Share of the poses of a part that are fitted where all are."""


def parts(poses: PoseSet) -> dict[str, np.ndarray]:
    """Masks (N,) of the parts."""
    found = {}
    for name, values in (("xyz", poses.position), ("q", poses.q)):
        for k, column in enumerate(values.T):
            own = f"q{k + 1}" if name == "q" else name[k]
            middle = np.median(column)
            found |= {f"{own} low": column < middle, f"{own} high": column >= middle}
    apart = np.linalg.norm(poses.position - np.median(poses.position, axis=0), axis=1)
    found["middle"] = apart < np.quantile(apart, 0.2)
    found["corner"] = np.all(poses.position < np.quantile(poses.position, 0.55, axis=0), axis=1)
    return found


def main() -> None:
    """Command line."""
    model = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    poses = read_poses([EXAMPLE / "grid.csv"], model)
    rows = []
    for name, mask in parts(poses).items():
        part, rest = np.flatnonzero(mask), np.flatnonzero(~mask)
        mixed = np.random.default_rng(1).permutation(part)
        for count in (int(len(part) * _SHARE), 60):
            fitted, inside = poses.subset(np.sort(mixed[:count])), poses.subset(mixed[count:])
            p90 = []
            for terms in (("kinematic",), None):
                robot = calibrate(model, fitted, terms=terms).model
                there = prediction_errors(robot, poses.subset(rest))
                p90.append((there.all.p90, prediction_errors(robot, inside).all.p90))
            predicted = observed_over_predicted(there)
            rows.append((p90[1][0] / p90[0][0], p90[1][1] / p90[0][1], predicted))
            print(
                f"{name:7s} {count:3d} poses: P90 {1e3 * p90[1][0]:.3f} mm, {rows[-1][0]:.2f} times that of the geometry alone, inside "
                f"{rows[-1][1]:.2f} times; observed over predicted {predicted:.2f}",
                flush=True,
            )
    every = np.array(rows)
    middle, most = np.median(every, axis=0).round(2), every.max(axis=0).round(2)
    print(
        f"{len(rows)} calibrations (rest, inside, observed over predicted): median {middle}, largest {most}"
    )


if __name__ == "__main__":
    main()
