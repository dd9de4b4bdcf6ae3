"""The running server of a studio, and where it listens."""

from __future__ import annotations

import http.client
import ipaddress
import secrets
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError, InputError
from flexcal.studio.server.answer import Route
from flexcal.studio.server.gate import Gate, own_hosts

if TYPE_CHECKING:
    import viser

LOOPBACK = "127.0.0.1"
_FIRST_PORT = 8080
_PORTS = 20
"""Ports that are tried before any free one is taken."""
_PATIENCE, _TRIES = 10.0, 6
"""Seconds that the own server may take to answer, and how often it is asked."""


class StudioServer:
    """A server for one user, who knows its `url`; the window is built on its `viser`.

    Everybody else is refused: requests without the token in their path, sent to another name, or by another site's page.
    """

    viser: viser.ViserServer
    url: str

    def __init__(self, server: viser.ViserServer, url: str) -> None:
        self.viser, self.url = server, url

    @classmethod
    def start(cls, host: str, port: int | None, routes: Mapping[str, Route], files: Route) -> StudioServer:
        """Listen on a host (`127.0.0.1`: for this machine alone) and a port (0: any free one; None: 8080 or one of those after it).

        Each of `routes` answers the paths below its name, so that `<a href="pick/12">` in the window calls `routes["pick"]("12")`;
        `files` those below `files/`, each with a token of its own. Raises `FlexcalError` without viser and where its version cannot be
        protected, `InputError` for an address or port that cannot be had.
        """
        try:
            from flexcal.studio.server import gated_viser
        except ModuleNotFoundError as problem:
            if (problem.name or "").startswith("flexcal"):
                raise
            raise FlexcalError(
                "E-STUDIO-001", "the studio needs viser: pip install 'flexcal[studio]'."
            ) from problem
        listening = _listening(host, port)
        found, number = listening.getsockname()[:2]
        gate = _gate(host, found, number)
        server = gated_viser.start_viser(listening, gated_viser.Site(gate, routes, files))
        if server is None or not _refuses(found, number, gate.token):
            import viser

            listening.close()
            if server is not None:
                gated_viser.stop_viser(server)
            raise FlexcalError(
                "E-STUDIO-002",
                f"the studio cannot keep others out with viser {viser.__version__} and does not start; pip install 'flexcal[studio]'.",
            )
        return cls(server, f"http://{_shown(host, found, number)}/{gate.token}/")

    def stop(self) -> None:
        """Close all connections, and free the port."""
        from flexcal.studio.server.gated_viser import stop_viser

        stop_viser(self.viser)


def _listening(host: str, port: int | None) -> socket.socket:
    """A socket that listens; raises `InputError` where there is none to be had."""
    tried = [port] if port is not None else [*range(_FIRST_PORT, _FIRST_PORT + _PORTS), 0]
    try:
        family, _, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind(address)
    except (OSError, UnicodeError) as problem:
        raise InputError(
            "E-STUDIO-003",
            f"{host} is no address of this machine ({problem}); give another --host, or none.",
        ) from problem
    for number in tried:
        listening = socket.socket(family, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((address[0], number, *address[2:]))
            listening.listen(128)
            return listening
        except (OSError, OverflowError) as problem:
            listening.close()
            if number == tried[-1]:
                raise InputError(
                    "E-STUDIO-004",
                    f"the port {number} of {host} cannot be had ({problem}); give another --port, or --port 0 for any free one.",
                ) from problem
    raise AssertionError


def _gate(host: str, address: str, port: int) -> Gate:
    names = [LOOPBACK, "localhost", "::1", host, address]
    if not _is_loopback(address):
        names += [socket.gethostname(), f"{socket.gethostname()}.local"]
    return Gate(
        secrets.token_urlsafe(32),
        secrets.token_bytes(32),
        own_hosts(names, port),
        port,
        any_address=ipaddress.ip_address(address).is_unspecified,
    )


def _is_loopback(address: str) -> bool:
    return ipaddress.ip_address(address).is_loopback


def _shown(host: str, address: str, port: int) -> str:
    """Host and port as the URL has them; of a server on all interfaces the machine's own address, where it has one."""
    name = host
    if ipaddress.ip_address(address).is_unspecified:
        name = LOOPBACK
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(("192.0.2.1", 9))  # sends nothing, but finds the interface
            name = probe.getsockname()[0]
    return f"[{name}]:{port}" if ":" in name else f"{name}:{port}"


def _refuses(address: str, port: int, token: str) -> bool:
    """Whether the server refuses requests without its token, and those to another name."""
    unspecified = ipaddress.ip_address(address).is_unspecified
    reached = ("::1" if ":" in address else LOOPBACK) if unspecified else address
    own = f"[{reached}]:{port}" if ":" in reached else f"{reached}:{port}"
    strangers = [("/", own), (f"/{'x' * len(token)}/", own), (f"/{token}/", f"studio.invalid:{port}")]
    return all(_status(reached, port, *stranger) == 403 for stranger in strangers)


def _status(address: str, port: int, path: str, host: str) -> int | None:
    """Status of the answer; None where there is none, however often it is asked for: a machine may be busy, or asleep for a while."""
    for _ in range(_TRIES):
        connection = http.client.HTTPConnection(address, port, timeout=_PATIENCE)
        try:
            connection.request("GET", path, headers={"Host": host})
            response = connection.getresponse()
            response.read()
            return response.status
        except TimeoutError:
            continue
        except (OSError, http.client.HTTPException):
            return None
        finally:
            connection.close()
    return None
