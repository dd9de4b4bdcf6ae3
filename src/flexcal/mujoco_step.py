"""MuJoCo's step function as C++ kernels call it."""

from __future__ import annotations

import ctypes
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
    raise FlexcalError(f"no MuJoCo library lies in {folder}; reinstall the package mujoco.")
