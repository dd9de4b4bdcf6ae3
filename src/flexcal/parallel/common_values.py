"""Values that all tasks have in common, unpickled once in a worker process."""

from __future__ import annotations

import pickle
import uuid
from dataclasses import dataclass
from typing import Any

_unpickled: dict[str, tuple[Any, ...]] = {}
"""The last values of this process, by name."""


@dataclass(frozen=True)
class CommonValues:
    """Pickled values that are sent with every task and unpickled by the first of them in a process."""

    name: str
    data: bytes

    @staticmethod
    def of(values: tuple[Any, ...]) -> CommonValues:
        """The values, pickled; functions and classes of a script, too."""
        from joblib.externals.loky.backend.reduction import dumps

        return CommonValues(uuid.uuid4().hex, bytes(dumps(values)))

    def values(self) -> tuple[Any, ...]:
        """The values in this process."""
        if self.name not in _unpickled:
            _unpickled.clear()
            _unpickled[self.name] = pickle.loads(self.data)
        return _unpickled[self.name]
