"""mujoco.sysid fits gains, friction, armature and delays of two joints to a log of commands and positions, in one thread."""

import json
import sys
import time

import mujoco
import numpy as np
from mujoco import sysid

request = json.load(sys.stdin)
spec = mujoco.MjSpec.from_string(request["mjcf"])
joints = request["joints"]
for joint in joints:
    spec.add_sensor(
        name=f"{joint}_pos",
        type=mujoco.mjtSensor.mjSENS_JOINTPOS,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        objname=joint,
    )
model = spec.compile()
command, measured = np.array(request["command"]), np.array(request["q"])
times = request["time_step"] * np.arange(len(command))


def stiffness(s, p, name):
    s.actuator(name).gainprm[0] = p.value[0]
    s.actuator(name).biasprm[1] = -p.value[0]


def damping(s, p, name):
    s.actuator(name).biasprm[2] = -p.value[0]


def coulomb(s, p, name):
    s.joint(name).frictionloss = p.value[0]


def armature(s, p, name):
    s.joint(name).armature = p.value[0]


def nothing(s, p, name):
    """The delay is one of the commands."""


SETTERS = {
    "stiffness": stiffness,
    "damping": damping,
    "coulomb": coulomb,
    "armature": armature,
    "delay": nothing,
}
params = sysid.ParameterDict()
for joint in joints:
    for key, setter in SETTERS.items():
        start = request["start"][joint][key]
        low, high = (0.0, 0.05) if key == "delay" else (0.1 * start, 10 * start)
        params.add(
            sysid.Parameter(
                f"{joint}.{key}",
                nominal=start,
                min_value=low,
                max_value=high,
                modifier=lambda s, p, f=setter, n=joint: f(s, p, n),
            )
        )


def delayed_rollout(models, datas, control_signal, initial_states, param_dicts, **mappings):
    """Rollouts under the commands, delayed joint by joint."""
    late = []
    for control, own in zip(control_signal, param_dicts, strict=True):
        data = np.stack(
            [
                np.interp(control.times - own[f"{joint}.delay"].value[0], times, command[:, i])
                for i, joint in enumerate(joints)
            ],
            axis=1,
        )
        late.append(sysid.TimeSeries(control.times, data, control.signal_mapping))
    return sysid.sysid_rollout(
        models=models, datas=datas, control_signal=late, initial_states=initial_states, **mappings
    )


begin = sysid.create_initial_state(model, measured[0], np.zeros(model.nv))
sequences = sysid.ModelSequences(
    "arm",
    spec,
    "moves",
    begin,
    sysid.TimeSeries.from_control_names(times, command, model),
    sysid.TimeSeries.from_names(times, measured, model, names=[f"{joint}_pos" for joint in joints]),
)
residual = sysid.build_residual_fn(
    models_sequences=[sequences], custom_rollout=delayed_rollout, n_threads=1, resample_true=True
)
started = time.process_time()
found, _ = sysid.optimize(initial_params=params, residual_fn=residual, optimizer="mujoco", verbose=False)
seconds = time.process_time() - started
values = {joint: {key: float(found[f"{joint}.{key}"].value[0]) for key in SETTERS} for joint in joints}
print(json.dumps({"seconds": seconds, "values": values}))
