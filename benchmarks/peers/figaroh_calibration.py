"""figaroh calibrates a robot on full poses: its parameter selection, its start of base and tip, its least squares with differences."""

import contextlib
import json
import sys
import time
import warnings
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm
from figaroh.calibration.config import unified_to_legacy_config

warnings.simplefilter("ignore")
request = json.load(sys.stdin)
q, points, fresh = (np.array(request[key]) for key in ("q", "points", "fresh"))
turns = [np.array(turn) for turn in request["turns"]]
model = pin.buildModelFromUrdf(request["urdf"])
robot = SimpleNamespace(model=model, data=model.createData(), q0=pin.neutral(model))
config = unified_to_legacy_config(
    robot,
    {
        "kinematics": {"base_frame": "universe", "tool_frame": request["frame"]},
        "parameters": {"calibration_level": "full_params"},
        "measurements": {"markers": [{"measurable_dof": [True] * 6}], "poses": {}},
    },
)
config |= {
    "NbSample": len(q),
    "known_baseframe": False,
    "known_tipframe": False,
    "measurement_std": {"position": request["noise"], "orientation": request["turn_noise"]},
}


class Calibration(BaseCalibration):
    """As its examples: residuals of the logarithm of the pose, weighted by their noise."""

    def __init__(self):
        self.robot, self.model, self.data, self.calib_config = robot, model, robot.data, config
        self.del_list_, self.STATUS, self._val_available = [], "NOT CALIBRATED", False
        self.observations, self.stages = None, []
        self.q_measured = q
        rpy = np.array([pin.rpy.matrixToRpy(turn) for turn in turns])
        self.PEE_measured = np.hstack([points, rpy]).T.ravel()

    def cost_function(self, var):
        seen = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        return self.apply_measurement_weighting(self._compute_logmap_residuals(self.PEE_measured, seen))


started = time.perf_counter()
with contextlib.redirect_stdout(sys.stderr):
    calibration = Calibration()
    calibration.create_param_list(q)
    names = config["param_name"]
    guess = calibration.initial_frame_guess()
    start = np.array([guess.get(name, 0.0) for name in names])
    result = calibration.solve_optimisation(var_init=start, method="lm")[0]
seconds = time.perf_counter() - started
config["NbSample"] = len(fresh)
predicted = calc_updated_fkm(model, robot.data, result.x, fresh, config).reshape(6, len(fresh)).T
print(
    json.dumps(
        {
            "seconds": seconds,
            "parameters": len(names),
            "points": predicted[:, :3].tolist(),
            "turns": [pin.rpy.rpyToMatrix(row).tolist() for row in predicted[:, 3:]],
        }
    )
)
