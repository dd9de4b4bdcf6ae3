"""MuJoCo's warnings as records of Python's logging."""

from __future__ import annotations

import logging


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
