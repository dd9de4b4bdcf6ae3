"""figaroh designs an exciting trajectory: its cubic segments through random waypoints, which Ipopt moves to lower the condition number.

All settings are figaroh's defaults, less the segments' duration. What figaroh leaves to its user is done here: convex hulls for meshes,
the pairs of shapes to compare (the floor is in none), and the numbers of the active joints, which its parser forgets. Its two stages
share the processor time given, and begin again while there is some left. Where Ipopt ends without an answer, the best of its iterates
that keeps all of figaroh's constraints counts; the starting guess is the first.
"""

import contextlib
import json
import logging
import sys
import tempfile
import time
import warnings
from pathlib import Path
from types import SimpleNamespace

import coal
import numpy as np
import pinocchio as pin
import yaml
from figaroh.optimal.base_optimal_trajectory import BaseOptimalTrajectory, BaseTrajectoryIPOPTProblem
from figaroh.tools.robot import Robot

WAYPOINTS, STAGES, RATE_HZ = 5, 2, 100
"""figaroh's defaults."""
FINE_HZ = 1000


class Problem(BaseTrajectoryIPOPTProblem):
    """One stage: ends with the time given, and remembers the best iterate that keeps all constraints."""

    deadline = np.inf

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.best = (np.inf, None)

    def gradient(self, X):
        """Asked for at every iterate that Ipopt accepts."""
        self._consider(np.array(X))
        return super().gradient(X)

    def intermediate(self, *state):
        return super().intermediate(*state) and time.process_time() < self.deadline

    def solve_with_waypoints(self, wps):
        self._initial_wps = wps
        self._consider(np.array(self.get_initial_guess()))
        success, results = super().solve_with_waypoints(wps)
        if not success and self.best[1] is None:
            return False, results
        x = np.array(results["x_opt"]) if success else self.best[1]
        way = np.vstack((self.wp_init, x.reshape(self.n_wps - 1, self.n_joints)))
        self.objective(x)
        fine = self.opt_traj.CB.get_full_config(FINE_HZ, self.tps, way.T, self.vel_wps, self.acc_wps)
        data = {
            "obj_values": [self.objective(x)],
            "final_waypoint": way[-1],
            "answer": success,
            "fine": fine[1:],
        }
        return True, {**{key: self.opt_cb[key] for key in ("t_f", "p_f", "v_f", "a_f")}, "iter_data": data}

    def _consider(self, x):
        if self._is_feasible(x) and self._is_collision_free(x) and self.objective(x) < self.best[0]:
            self.best = self.objective(x), x


class Trajectory(BaseOptimalTrajectory):
    """figaroh's design with that problem."""

    def __init__(self, robot, joints, config, end):
        super().__init__(robot, joints, config)
        self.identif_config["act_idxv"] = list(range(robot.model.nv))
        self.initialize()
        self.end = end

    def create_ipopt_problem(self, *arguments):
        problem = Problem(self, *arguments)
        left = STAGES - len(self.results["T_F"])
        problem.deadline = time.process_time() + (self.end - time.process_time()) / left
        return problem

    def attempt(self):
        """Both stages from a new guess: own condition number, whether Ipopt answered, q, q̇, q̈ (3, N, n); None where a stage fails."""
        self.results = {key: [] for key in ("T_F", "P_F", "V_F", "A_F", "iteration_data")}
        stages = self.solve(stack_reps=STAGES)["iteration_data"]
        if len(stages) < STAGES:
            return None
        samples = round(FINE_HZ * self.trajectory_config["t_s"] * (WAYPOINTS - 1))
        motion = np.concatenate([np.array(stage["fine"])[:, :samples] for stage in stages], axis=1)
        return stages[-1]["obj_values"][-1], all(stage["answer"] for stage in stages), motion


def arm(request, folder):
    """The robot with gripper joints fixed, hulls for meshes, and the pairs of shapes to compare."""
    text = Path(request["urdf"]).read_text()
    for joint in request["locked"]:
        text = text.replace(
            f'<joint name="{joint}" type="prismatic">', f'<joint name="{joint}" type="fixed">'
        )
    urdf = Path(folder, "arm.urdf")
    urdf.write_text(text)
    robot = Robot(str(urdf), request["packages"])
    shapes = robot.geom_model
    for item in shapes.geometryObjects:
        if isinstance(item.geometry, coal.BVHModelBase):
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    for pair in request["pairs"]:
        shapes.addCollisionPair(pin.CollisionPair(*(shapes.getGeometryId(name) for name in pair)))
    return robot


def design(request, folder):
    """The best of all attempts that the time allows."""
    began = time.process_time()
    end = began + request["seconds"]
    robot = arm(request, folder)
    joints = list(robot.model.names)[1:]
    segment = request["duration"] / (STAGES * (WAYPOINTS - 1))
    settings = {"waypoints": WAYPOINTS, "frequency": RATE_HZ, "segment_duration": segment}
    config = {
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": joints}}},
        "tasks": {
            "identification": {"problem": {}, "signal_processing": {}},
            "optimal_trajectory": {"trajectory": settings},
        },
    }
    file = Path(folder, "arm.yaml")
    file.write_text(yaml.safe_dump(config))
    trajectory = Trajectory(robot, joints, str(file), end)
    best = SimpleNamespace(condition=np.inf, answer=False, motion=None)
    attempts = 0
    while time.process_time() < end:
        attempts += 1
        found = trajectory.attempt()
        if found is not None and found[0] < best.condition:
            best = SimpleNamespace(condition=found[0], answer=found[1], motion=found[2].tolist())
    return {**vars(best), "attempts": attempts, "seconds": time.process_time() - began}


warnings.simplefilter("ignore")
logging.disable(logging.CRITICAL)
payload = json.load(sys.stdin)
np.random.seed(payload["seed"])  # noqa: NPY002  figaroh draws from NumPy's global generator
with tempfile.TemporaryDirectory() as place, contextlib.redirect_stdout(sys.stderr):
    answer = design(payload, place)
print()
print(json.dumps(answer))
