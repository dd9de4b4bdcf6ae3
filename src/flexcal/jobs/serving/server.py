"""A server on this machine: a line of JSON in, a line of JSON out, on a Unix socket or a TCP port of 127.0.0.1."""

from __future__ import annotations

import asyncio
import hmac
import json
import os
import resource
import secrets
import signal
import socket
import stat
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import open_regular
from flexcal.jobs.serving.answers import DONE, Answers
from flexcal.jobs.serving.first_problems import FirstProblems

LONGEST_LINE = 1 << 16
"""Bytes of a line."""
_MOST_CLIENTS = 4096
_MOST_STRANGERS = 256
"""Connections that have not sent the token yet."""
_TOKEN_WAIT = 5.0
"""Seconds in which a connection sends the token."""
_BACKLOG = 1024
_LOOPBACK = "127.0.0.1"
_LONGEST_PATH = 107
"""Bytes of the path of a socket."""

Ready = Callable[[str], None]
"""Told where the server listens once it does."""


@dataclass
class Served:
    """What a server has done: numbers of `connections`, `answers`, and connections `refused`."""

    connections: int = 0
    answers: int = 0
    refused: int = 0


class _Server:
    """Connections of one server; those of TCP begin with a line that has the `token`."""

    def __init__(self, answers: Answers, token: str | None) -> None:
        self.answers, self.token = answers, token
        self.served, self.problems = Served(), FirstProblems()
        self._clients = 0
        self._strangers: dict[asyncio.StreamWriter, None] = {}  # in the order of their arrival

    async def connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a client until it goes; whatever it does, the others are not concerned."""
        self.served.connections += 1
        with suppress(ConnectionError), closing(writer):
            if self.token is None or await self._has_token(reader, writer):
                await self._serve(reader, writer)

    async def _has_token(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Whether the first line has the token; it is waited for only so long, and of so many connections at once."""
        if len(self._strangers) == _MOST_STRANGERS:
            # a client sends its token at once: the one that has been silent for longest is none
            longest = next(iter(self._strangers))
            del self._strangers[longest]
            self._refuse(longest, "too many connections have not sent the token")
            longest.close()
        self._strangers[writer] = None
        try:
            async with asyncio.timeout(_TOKEN_WAIT):
                line = await self._line(reader, writer)
        except TimeoutError:
            self._refuse(writer, f"no token came within {_TOKEN_WAIT:g} s")
            return False
        finally:
            self._strangers.pop(writer, None)
        if line is None:
            return False
        if not self._is_token(line):
            self._refuse(writer, 'the first line must be {"token": "…"} with the token of the server\'s file')
            return False
        return True

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._clients == _MOST_CLIENTS:
            self._refuse(writer, f"{_MOST_CLIENTS} clients are connected; try again later")
            return
        self._clients += 1
        try:
            if self.token is not None:
                writer.write(_said(DONE))
            while (line := await self._line(reader, writer)) is not None:
                writer.write(self._answer(line))
                self.served.answers += 1
                await writer.drain()
        finally:
            self._clients -= 1

    async def _line(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes | None:
        """The next line; None at the end of the connection, and for a line that is too long."""
        try:
            line = await reader.readline()
        except ValueError:
            self._refuse(writer, f"the line is longer than {LONGEST_LINE} bytes")
            return None
        return line if line.endswith(b"\n") else None

    def _answer(self, line: bytes) -> bytes:
        """The answer to a line, also where computing it fails: requests behind it wait for theirs."""
        try:
            return self.answers.of(line)
        except Exception as problem:
            self.problems.say(problem)
            return _said("this line made the server fail, which is a fault of flexcal; it answers the next")

    def _refuse(self, writer: asyncio.StreamWriter, why: str) -> None:
        self.served.refused += 1
        writer.write(_said(why))

    def _is_token(self, line: bytes) -> bool:
        try:
            given = json.loads(line)["token"]
        except (ValueError, RecursionError, TypeError, KeyError, IndexError):
            return False
        assert self.token is not None
        return isinstance(given, str) and hmac.compare_digest(
            given.encode(errors="replace"), self.token.encode()
        )


def serve_unix(answers: Answers, path: Path, ready: Ready) -> Served:
    """Serve on a Unix socket that only its owner may use, until the process is interrupted or terminated.

    Raises `InputError` for a path that cannot be a socket, or on which another server listens.
    """
    _free(path)
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    before = os.umask(0o177)
    try:
        listening.bind(str(path))
    except OSError as problem:
        listening.close()
        raise InputError(
            "E-SERVE-001", f"no socket can be made at {path} ({problem.strerror}); give another --unix."
        ) from problem
    finally:
        os.umask(before)
    own = path.stat().st_ino
    try:
        return asyncio.run(_run(_Server(answers, None), listening, lambda: ready(str(path))))
    finally:
        with suppress(OSError):
            if path.stat().st_ino == own:
                path.unlink()


def serve_tcp(answers: Answers, port: int, token_file: Path, ready: Ready) -> Served:
    """Serve on a port of 127.0.0.1 (0: any free one) those who know the token in `token_file`, which is made where it is absent.

    Raises `InputError` for a port that is taken, and a token file that is empty or that others may read.
    """
    token = _token(token_file)
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((_LOOPBACK, port))
    except (OSError, OverflowError) as problem:
        listening.close()
        raise InputError(
            "E-SERVE-002", f"the port {port} of {_LOOPBACK} cannot be had ({problem}); give another --port."
        ) from problem
    host, found = listening.getsockname()
    return asyncio.run(_run(_Server(answers, token), listening, lambda: ready(f"{host}:{found}")))


async def _run(server: _Server, listening: socket.socket, ready: Callable[[], None]) -> Served:
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # not in the main thread, signals are not for this loop
        with suppress(ValueError, RuntimeError):
            loop.add_signal_handler(number, stop.set)
    loop.set_exception_handler(server.problems.of_loop)
    listener = await asyncio.start_server(
        server.connected, sock=listening, limit=LONGEST_LINE, backlog=_BACKLOG
    )
    ready()
    await stop.wait()
    listener.close()
    return server.served


def _said(sentence: str) -> bytes:
    return json.dumps({"status": sentence}).encode() + b"\n"


def _free(path: Path) -> None:
    """Remove the socket that a server left that is no more; raises `InputError` where something else is there."""
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise InputError(
            "E-SERVE-003",
            f"{path} is longer than the {_LONGEST_PATH} bytes that a socket's path can have; give a shorter --unix.",
        )
    try:
        kind = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(kind):
        raise InputError("E-SERVE-004", f"{path} is there and no socket; give another --unix.")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
    raise InputError("E-SERVE-005", f"another server listens on {path}; stop it, or give another --unix.")


def _token(path: Path) -> str:
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        with open_regular(path, limit=LONGEST_LINE) as file:
            if os.fstat(file.fileno()).st_mode & 0o077:
                raise InputError(
                    "E-SERVE-006",
                    f"others may read the token in {path}; make it yours alone: chmod 600 {path}.",
                ) from None
            token = file.read(LONGEST_LINE).decode("utf-8", errors="replace").strip()
        if not token:
            raise InputError("E-SERVE-007", f"{path} is empty; remove it for a new token.") from None
        return token
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        token = secrets.token_urlsafe(32)
        file.write(token + "\n")
    return token
