"""figaroh fits the base parameters of a robot to motions: its regressor, its elimination of silent columns, its double QR."""

import contextlib
import json
import sys
import time
import warnings
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate

warnings.simplefilter("ignore")
request = json.load(sys.stdin)
q, dq, ddq, torque = (np.array(request[key]) for key in ("q", "dq", "ddq", "torque"))
model = pin.buildModelFromUrdf(request["urdf"])
robot = SimpleNamespace(model=model, data=model.createData())
options = {
    "has_friction": True,
    "has_actuator_inertia": True,
    "has_joint_offset": True,
    "is_joint_torques": True,
    "act_idxv": list(range(model.nv)),
}
started = time.process_time()
with contextlib.redirect_stdout(sys.stderr):
    matrix = build_regressor_basic(robot, q, dq, ddq, options)
    names = {f"parameter_{k}": 0.0 for k in range(matrix.shape[1])}
    silent, seen = get_index_eliminate(matrix, names)
    reduced = build_regressor_reduced(matrix, silent)
    _, _, expressions, values = QRDecomposer().double_decomposition(torque.T.ravel(), reduced, seen)[:4]
seconds = time.process_time() - started
print(json.dumps({"seconds": seconds, "rank": len(expressions), "finite": bool(np.isfinite(values).all())}))
