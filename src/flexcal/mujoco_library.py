"""MuJoCo's step function as C++ kernels call it, and its warnings as records of Python's logging."""

from __future__ import annotations

import ctypes
import logging
from functools import cache
from pathlib import Path

from flexcal.errors import FlexcalError


@cache
def step_address() -> int:
    """Address of mj_step in the library that the mujoco package has loaded; raises `FlexcalError` where there is none."""
    import mujoco

    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for library in sorted(folder.glob(pattern)):
            address = ctypes.cast(ctypes.CDLL(str(library)).mj_step, ctypes.c_void_p).value
            if address:
                return address
    raise FlexcalError("E-CELL-011", f"no MuJoCo library lies in {folder}; reinstall the package mujoco.")


def log_mujoco_warnings() -> None:
    """Send MuJoCo's warnings to the logger `flexcal.mujoco`, unless the program has a handler of its own for them.

    Without a handler MuJoCo prints them and leaves a MUJOCO_LOG.TXT in the current folder. The logger is silent until a handler is
    added to it or to one of its parents: what the warnings mean for a result is said by the error that follows them.
    """
    import mujoco

    if mujoco.get_mju_user_warning() is None:
        logger = logging.getLogger("flexcal.mujoco")
        logger.addHandler(logging.NullHandler())
        mujoco.set_mju_user_warning(logger.warning)
