"""Answers to HTTP requests for something other than the window itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

PLAIN = "text/plain; charset=utf-8"


@dataclass(frozen=True)
class Answer:
    """Status, content type and bytes of an HTTP answer; `location` where it sends the browser elsewhere.

    `policy` is its Content-Security-Policy; by default the content may load and run nothing.
    """

    status: int
    kind: str = PLAIN
    body: bytes = b""
    policy: str = "default-src 'none'; frame-ancestors 'none'; sandbox"
    location: str | None = None


NO_CONTENT = Answer(204)
"""The browser stays where it is."""

Route = Callable[[str], Answer | None]
"""Answers the rest of a path below the route's name, percent-decoded, without its query; None where there is nothing.

It is called in a thread of its own, several at a time.
"""


def said(status: int, sentence: str) -> Answer:
    """A sentence as plain text."""
    return Answer(status, body=f"{sentence}\n".encode())
