"""Problems of a server that may come by the thousand, such as bad messages and a want of file descriptors."""

from __future__ import annotations

import asyncio
import sys
from typing import Any


class FirstProblems:
    """Says the first problem of each type on a line of standard error, and is silent about all that follow."""

    def __init__(self) -> None:
        self._types: set[type[BaseException]] = set()

    def say(self, problem: BaseException) -> None:
        """Report an exception, unless one of its type was."""
        if type(problem) in self._types:
            return
        self._types.add(type(problem))
        # what clients send may hold escape sequences and line ends
        told = ascii(str(problem))[:200]
        print(
            f"the server met {type(problem).__name__}: {told}; it goes on, and is silent about more of these",
            file=sys.stderr,
            flush=True,
        )

    def of_loop(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handler of exceptions for an event loop; connections that are open at its end are no problem."""
        problem = context.get("exception")
        if problem is not None and not isinstance(problem, asyncio.CancelledError):
            self.say(problem)
