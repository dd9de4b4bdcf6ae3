"""Progress reports of long computations."""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done: 0 when it begins, 1 when it ends."""


def silent(stage: str, share: float) -> None:
    """The `Progress` that tells nobody."""
