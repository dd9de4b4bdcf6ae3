"""Actuators of the arm of `examples/servo_arm` against mujoco.sysid on the same log and parameters: errors and processor time, one thread.

mujoco.sysid starts from values that are 30 % off, and at 5 ms of delay; flexcal finds its own.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers import run_peer
from flexcal.actuators import Servo, fit_actuators
from flexcal.data.recordings import CommandLog, read_command_log
from flexcal.export import Actuators, mjcf_spec
from flexcal.model.robot import RobotModel

FOLDER = Path(__file__).parent.parent / "examples" / "servo_arm"
TRUTH = {
    "stiffness": (900.0, 300.0),
    "damping": (66.0, 22.0),
    "coulomb": (4.0, 1.5),
    "armature": (0.8, 0.25),
    "delay": (0.012, 0.012),
}
"""As the simulation that wrote the log has it; the damping with the viscous friction."""
OFF, DELAY = np.array([0.7, 1.3]), 0.005
STEPS = (1e-3, 2.5e-4)
"""Time steps, s, of mujoco.sysid's model: its errors are in proportion to them. The second is that of exported MJCF; flexcal simulates
with 1 ms, and corrects what is of first order in it."""


def run() -> list[tuple[str, float, str]]:
    """Ratios mujoco.sysid to flexcal of the errors and of processor time, by the time step of mujoco.sysid's model."""
    model = RobotModel.from_yaml(FOLDER / "robot.yaml", estimates=False)
    log = read_command_log(FOLDER / "moves.csv", model)
    fit_actuators(model, [log], Servo(), hold_out=0.1)  # imports
    started = time.process_time()
    fit = fit_actuators(model, [log], Servo(), hold_out=0.1)
    seconds = time.process_time() - started
    own = _error({key: getattr(fit.actuators, key) for key in TRUTH})
    rows = []
    for step in STEPS:
        peer = run_peer("mujoco_sysid.py", ("mujoco[sysid]==4.0.0",), _request(model, log, step))
        error = _error({key: [peer["values"][joint][key] for joint in model.joint_names] for key in TRUTH})
        label = f"of ten actuator parameters, mujoco.sysid at {1e3 * step:g} ms"
        rows += [
            (f"error {label}, 1 wanted", error / own, f"rms {100 * error:.2f} % against {100 * own:.2f} %"),
            (
                f"time {label}",
                peer["seconds"] / seconds,
                f"{peer['seconds']:.2f} s against {seconds:.2f} s, log of {log.duration:.0f} s, one thread each",
            ),
        ]
    return rows


def _request(model: RobotModel, log: CommandLog, step: float) -> dict[str, Any]:
    import mujoco

    first = {key: OFF * value if key != "delay" else np.full(2, DELAY) for key, value in TRUTH.items()}
    spec = mjcf_spec(
        model,
        actuators=Actuators(
            stiffness=first["stiffness"],
            damping=first["damping"],
            viscous=np.zeros(2),
            coulomb=first["coulomb"],
            armature=first["armature"],
            delay=first["delay"],
        ),
    )
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compile()
    return {
        "mjcf": spec.to_xml(),
        "joints": list(model.joint_names),
        "command": log.command.tolist(),
        "q": log.q.tolist(),
        "time_step": log.time_step,
        "start": {
            joint: {key: float(value[i]) for key, value in first.items()}
            for i, joint in enumerate(model.joint_names)
        },
    }


def _error(found: Mapping[str, Sequence[float]]) -> float:
    """Root mean square of the relative errors."""
    return float(
        np.sqrt(np.mean([(np.array(found[key]) / np.array(true) - 1) ** 2 for key, true in TRUTH.items()]))
    )
