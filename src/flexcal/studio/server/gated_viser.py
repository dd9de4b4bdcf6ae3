"""viser's server behind the gate: it sees only requests that were let in, with the token taken out of their path."""

from __future__ import annotations

import asyncio
import contextlib
import http
import inspect
import io
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import unquote

import viser
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from flexcal.jobs.serving import FirstProblems
from flexcal.studio.server.answer import Answer, Route, said
from flexcal.studio.server.gate import FILES, Gate, Passage
from flexcal.studio.server.window_page import window_page

REFUSAL = said(403, "This address is not open to you. Use the one that flexcal studio has printed.")
_ABSENT = said(404, "There is nothing at this address.")

_COMMON = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass(frozen=True)
class Site:
    """What is served beside viser's page, and the gate before all of it: `routes` by the first name of a path, and `files` below FILES."""

    gate: Gate
    routes: Mapping[str, Route]
    files: Route


class GatedViser(viser.ViserServer):
    """A viser server that cannot be shared through somebody else's machine."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """None; nothing is asked of share.viser.studio, whoever wants it."""
        return None

    def disconnect_share_url(self) -> None:
        """There is nothing to disconnect."""


def start_viser(listening: socket.socket, site: Site) -> GatedViser | None:
    """viser on a socket that is bound already, behind the gate; None where this viser does not let itself be put there.

    viser calls `websockets.asyncio.server.serve` by that name. In the meantime another function has the name, which puts
    the gate before viser's answers, and takes our socket in place of the port that viser would bind.
    """
    used = threading.Event()
    serve = websockets.asyncio.server.serve

    def gated_serve(
        handler: Callable[..., Any], host: str, port: int, *, process_request: Any = None, **options: Any
    ) -> Any:
        used.set()
        asyncio.get_running_loop().set_exception_handler(_PROBLEMS.of_loop)
        return serve(
            handler,
            sock=listening,
            process_request=_gated(site, process_request),
            logger=_LOGGER,
            server_header=None,
            **options,
        )

    address, port = listening.getsockname()[:2]
    websockets.asyncio.server.serve = gated_serve  # type: ignore[assignment, misc]
    try:
        with _silent():
            server = GatedViser(host=address, port=port, verbose=False)
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
    if not used.is_set() or server.get_port() != port:
        stop_viser(server)
        return None
    return server


def stop_viser(server: viser.ViserServer) -> None:
    """Stop it without a word; viser says so on standard output."""
    with _silent():
        server.stop()


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    with contextlib.redirect_stdout(io.StringIO()):
        yield


def _gated(site: Site, inner: Any) -> Any:
    async def process_request(connection: Any, request: Request) -> Response | None:
        passage = site.gate.passage(request.path, request.headers.raw_items())
        if passage is None:
            return _response(REFUSAL)
        if passage.upgrade:
            # viser knows a websocket by this very word alone
            if request.headers.get("Upgrade", "").lower() != "websocket":
                return _response(REFUSAL)
            return None
        if passage.path is None:
            return _response(Answer(308, location=request.path + "/"))
        answer = await _routed(site, passage)
        if answer is not None:
            return _response(answer)
        plain = [
            (name, value) for name, value in request.headers.raw_items() if name.lower() != "accept-encoding"
        ]
        response = inner(connection, replace(request, path="/", headers=Headers(plain)))
        if inspect.isawaitable(response):
            response = await response
        if response is None or response.status_code != 200:
            return _response(_ABSENT)
        return _response(window_page(bytes(response.body), passage.host))

    return process_request


async def _routed(site: Site, passage: Passage) -> Answer | None:
    """The answer of a route, None where viser is to answer."""
    assert passage.path is not None
    path = passage.path.partition("?")[0]
    if not path:
        return None  # the window is one page; viser has no other files
    name, _, rest = path.partition("/")
    if name == FILES:
        if passage.key == "token":
            # a page from the folder knows its own address: one that opens nothing else
            return Answer(302, location=f"/{site.gate.page_token(path)}/{path}")
        return await _call(site.files, rest)
    return await _call(site.routes[name], rest) if name in site.routes else _ABSENT


async def _call(route: Route, rest: str) -> Answer:
    try:
        decoded = unquote(rest, errors="strict")
    except UnicodeDecodeError:
        return _ABSENT
    return await asyncio.to_thread(route, decoded) or _ABSENT


def _response(answer: Answer) -> Response:
    headers = Headers(
        {**_COMMON, "Content-Security-Policy": answer.policy, "Content-Length": str(len(answer.body))}
    )
    if answer.status != 204:
        headers["Content-Type"] = answer.kind
    if answer.location is not None:
        headers["Location"] = answer.location
    return Response(answer.status, http.HTTPStatus(answer.status).phrase, headers, answer.body)


class _FirstOnly(logging.Filter):
    """Leaves out what strangers cause, handshakes that failed or were refused; of all else the first of each type is said."""

    def filter(self, record: logging.LogRecord) -> bool:
        if record.exc_info and not record.getMessage().startswith(
            ("opening handshake failed", "connection rejected")
        ):
            problem = record.exc_info[1]
            assert problem is not None
            _PROBLEMS.say(problem)
        return False


_PROBLEMS = FirstProblems()
_LOGGER = logging.getLogger("flexcal.studio.connections")
_LOGGER.addFilter(_FirstOnly())
