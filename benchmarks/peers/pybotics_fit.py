"""pybotics fits 24 MDH parameters of a UR10 to points, as its own example does: scalar distances, finite differences."""

import json
import sys
import time

import numpy as np
from pybotics.optimization import OptimizationHandler, compute_absolute_errors, optimize_accuracy
from pybotics.predefined_models import ur10
from pybotics.robot import Robot
from scipy.optimize import least_squares

request = json.load(sys.stdin)
rng = np.random.default_rng(request["seed"])
nominal = Robot.from_parameters(ur10())
nominal.tool.position = (
    [0.1, 0.0, 0.15] if max(abs(nominal.kinematic_chain.vector)) < 10 else [100.0, 0.0, 150.0]
)
unit = 1.0 if max(abs(nominal.kinematic_chain.vector)) < 10 else 1000.0
true = Robot.from_parameters(ur10())
true.tool.position = nominal.tool.position
vector = true.kinematic_chain.vector.copy()
angles = np.tile([True, False, True, False], 6)  # alpha, a, theta, d
vector += np.where(angles, 5e-4, 3e-4 * unit) * rng.normal(size=24)
true.kinematic_chain.vector = vector
q = rng.uniform(-np.pi, np.pi, (request["poses"], 6))
points = np.array([true.fk(row)[:3, 3] for row in q]) + 3e-5 * unit * rng.normal(size=(request["poses"], 3))
handler = OptimizationHandler(robot=nominal, kinematic_chain_mask=True)
started = time.perf_counter()
result = least_squares(
    optimize_accuracy, handler.generate_optimization_vector(), args=(handler, q, points), verbose=0
)
seconds = time.perf_counter() - started
handler.apply_optimization_vector(result.x)
print(
    json.dumps(
        {
            "seconds": seconds,
            "condition": float(np.linalg.cond(result.jac)),
            "mean_mm": float(compute_absolute_errors(q, points, handler.robot).mean() / unit * 1e3),
        }
    )
)
