"""figaroh chooses measurements out of a pool by its DETMAX, from information matrices given to it."""

import contextlib
import json
import random
import sys
import time
import warnings

import numpy as np
from figaroh.optimal.base_optimal_calibration import Detmax

warnings.simplefilter("ignore")
request = json.load(sys.stdin)
rows = np.array(request["rows"])
pool = {i: block.T @ block for i, block in enumerate(rows)}
random.seed(request["seed"])
started = time.process_time()
with contextlib.redirect_stdout(sys.stderr):
    history = Detmax(pool, request["count"]).main_algo()
print(json.dumps({"seconds": time.process_time() - started, "log_det": float(np.log(history[-1]))}))
