"""File `learned_residual.npz`, and its link to the estimates.

`names` (n,), `shares` (n, n), `inputs` (n, m, 3), `values` (n, m), `lengths` (n, 3), `amplitude`, `noise`, `inflation` (n,) are those of
`LearnedResidual`; `dynamics` is the SHA-256 of the block that it was learned with.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexcal.dynamics.residual.gaussian_process import GaussianProcess
from flexcal.dynamics.residual.learned_torque import LearnedMotor, LearnedResidual
from flexcal.errors import InputError
from flexcal.files.formats import ArrayForm, NpzFile, block_sha256, refuse_foreign
from flexcal.files.transaction import atomic_path, refuse_irregular

LEARNED = "learned_residual.npz"
_NUMBERS = ArrayForm("real", ("motors",))
_FORMS = {
    "names": ArrayForm("text", ("motors",)),
    "shares": ArrayForm("real", ("motors", "motors")),
    "inputs": ArrayForm("real", ("motors", "inputs", 3)),
    "values": ArrayForm("real", ("motors", "inputs")),
    "lengths": ArrayForm("real", ("motors", 3)),
    "amplitude": _NUMBERS,
    "noise": _NUMBERS,
    "inflation": _NUMBERS,
    "dynamics": ArrayForm("text"),
}


def require_residual_path(path: Path) -> None:
    """Raise `InputError` if another program's file stands at `path`."""
    refuse_irregular(path)
    refuse_foreign(path, _FORMS.keys())


def write_learned_residual(path: Path, learned: LearnedResidual, estimates: Path) -> None:
    """Write the learned residual to `path`, atomically, for the block `dynamics` of the file `estimates`; raises `InputError` if not
    possible.
    """
    processes = [motor.process for motor in learned.motors]
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez(
            stream,
            allow_pickle=False,
            names=np.array([motor.name for motor in learned.motors]),
            shares=learned.shares,
            inputs=np.array([p.inputs for p in processes]),
            values=np.array([p.values for p in processes]),
            lengths=np.array([p.lengths for p in processes]),
            amplitude=np.array([p.amplitude for p in processes]),
            noise=np.array([p.noise for p in processes]),
            inflation=np.array([motor.inflation for motor in learned.motors]),
            dynamics=np.array(block_sha256(estimates, "dynamics")),
        )


def read_learned_residual(path: str | Path, estimates: str | Path) -> LearnedResidual:
    """Read the learned residual torques that `identify dynamics --learn-residual` writes; needs no scikit-learn.

    Parameters
    ----------
    path : str or Path
        The file learned_residual.npz.
    estimates : str or Path
        The estimates.yaml of the dynamics that it was learned with.

    Returns
    -------
    LearnedResidual
        Its `torque` predicts mean and standard deviation of the residual torques.

    Raises
    ------
    InputError
        Where the file cannot be read, and where it was learned with other dynamics than those of `estimates`.

    Examples
    --------
    >>> import tempfile
    >>> from dataclasses import replace
    >>> from flexcal import RobotModel, identify_dynamics, read_learned_residual, read_recording
    >>> model = RobotModel.from_yaml("examples/tx40/robot.yaml")
    >>> log = read_recording("examples/tx40/exciting.parquet", model)
    >>> log = replace(log, q=log.q[:14000], torque=log.torque[:14000])
    >>> dynamics = identify_dynamics(model, [log], friction="classic", learn_residual=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dynamics.write(folder)
    ...     learned = read_learned_residual(f"{folder}/learned_residual.npz", f"{folder}/estimates.yaml")
    >>> learned.shares.shape
    (6, 6)
    """
    path, again = Path(path), "run 'flexcal identify dynamics --learn-residual' again"
    file = NpzFile(path, again)
    arrays = file.read(_FORMS)
    processes = [
        GaussianProcess(x, y, lengths, float(amplitude), float(noise))
        for x, y, lengths, amplitude, noise in zip(
            *(arrays[key] for key in ("inputs", "values", "lengths", "amplitude", "noise")), strict=True
        )
    ]
    motors = zip(arrays["names"], processes, arrays["inflation"], strict=True)
    learned = LearnedResidual(
        tuple(LearnedMotor(str(name), process, float(factor)) for name, process, factor in motors),
        arrays["shares"],
    )
    belongs_to = str(arrays["dynamics"])
    if belongs_to != block_sha256(estimates, "dynamics"):
        raise InputError(
            "E-DYN-030", f"{path} was learned with other dynamics than those of {estimates}; {again}."
        )
    return learned
