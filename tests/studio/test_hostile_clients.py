"""A real studio with clients that mean ill: without the token, from other pages, with strange requests, and with files that are bait."""

from __future__ import annotations

import http.client
import os
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from browser import studio
from refusals import refused
from waiting import PATIENCE, until

from flexcal.studio.server import ProjectFiles, StudioServer

viser = pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
SECRET = "secret-of-another-folder"


@dataclass(frozen=True)
class Reply:
    status: int
    headers: dict[str, str]
    body: bytes


@dataclass(frozen=True)
class Target:
    """A studio under attack."""

    url: str
    folder: Path

    @property
    def host(self) -> str:
        return urlsplit(self.url).netloc

    @property
    def token(self) -> str:
        return urlsplit(self.url).path.strip("/")

    def connect(self, address: str = "127.0.0.1") -> socket.socket:
        return socket.create_connection((address, urlsplit(self.url).port or 80), timeout=PATIENCE)

    def send(self, request: bytes) -> bytes:
        """What comes back for bytes, until the server closes."""
        with self.connect() as connection:
            connection.sendall(request)
            received = b""
            while True:
                try:
                    part = connection.recv(1 << 16)
                except ConnectionResetError:
                    return received
                if not part:
                    return received
                received += part
                head, separator, body = received.partition(b"\r\n\r\n")
                if separator and head.startswith(b"HTTP/1.1 101"):
                    return received
                length = re.search(rb"(?i)\r\ncontent-length: (\d+)", head)
                if separator and length and len(body) >= int(length[1]):
                    return received

    def ask(self, path: str, *headers: str, host: str | None = None, method: str = "GET") -> Reply:
        """The reply to a request; status 0 where the server hangs up."""
        lines = [f"{method} {path} HTTP/1.1", f"Host: {host or self.host}", *headers, "", ""]
        received = self.send("\r\n".join(lines).encode("utf-8"))
        if not received:
            return Reply(0, {}, b"")
        head, _, body = received.partition(b"\r\n\r\n")
        first, *rest = head.decode("latin-1").split("\r\n")
        fields = dict(line.split(": ", 1) for line in rest)
        return Reply(int(first.split()[1]), {name.lower(): value for name, value in fields.items()}, body)

    def file(self, path: str) -> Reply:
        """A file as the browser has it: through the window's link, which leads to an address with another token."""
        sent = self.ask(f"/{self.token}/files/{path}")
        assert sent.status == 302 and self.token not in sent.headers["location"]
        return self.ask(sent.headers["location"])


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Target]:
    outside = tmp_path_factory.mktemp("outside")
    folder = outside / "project"
    folder.mkdir()
    (outside / "other.yaml").write_text(SECRET)
    (outside / "other").mkdir()
    (outside / "other" / "page.html").write_text(SECRET)
    (outside / "project2").mkdir()
    (outside / "project2" / "page.html").write_text(SECRET)
    (folder / "results").mkdir()
    (folder / "results" / "report.html").write_text("<script>document.title = 1</script>")
    (folder / "poses é.csv").write_text("q1,q2\n")
    (folder / "arm.urdf").write_text("<robot/>")
    (folder / "code.py").write_text(SECRET)
    (folder / ".hidden.yaml").write_text(SECRET)
    (folder / ".git").mkdir()
    (folder / ".git" / "config.yaml").write_text(SECRET)
    (folder / "link.yaml").symlink_to(outside / "other.yaml")
    (folder / "away").symlink_to(outside / "other")
    (folder / "code.html").symlink_to(folder / "code.py")
    (folder / "inside.html").symlink_to(folder / "results" / "report.html")
    os.mkfifo(folder / "pipe.csv")
    (folder / "folder.html").mkdir()
    with studio(folder) as running:
        yield Target(running.url, folder)
        assert running.alive, "the server has died"
        said = running.errors.read_text().splitlines()[len(running.said) :]
        assert all(line.startswith("the server met ") for line in said) and len(said) < 10, said


UPGRADE = (
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
)


def protocol() -> str:
    return f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"


def assert_refused(reply: Reply, target: Target) -> None:
    """403, with a sentence that tells nothing."""
    assert reply.status == 403, reply
    assert reply.body == b"This address is not open to you. Use the one that flexcal studio has printed.\n"
    assert target.token not in str(reply.headers)


def test_the_user_is_let_in(target: Target) -> None:
    page = target.ask(f"/{target.token}/")
    assert page.status == 200 and page.body.startswith(b"<!")
    assert page.headers["referrer-policy"] == "no-referrer"
    assert page.headers["x-content-type-options"] == "nosniff"
    assert page.headers["cache-control"] == "no-store"
    assert page.headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
    assert "server" not in page.headers
    bare = target.ask(f"/{target.token}")
    assert (bare.status, bare.headers["location"]) == (308, f"/{target.token}/")
    opened = target.ask(f"/{target.token}", *UPGRADE, protocol(), f"Origin: http://{target.host}")
    assert opened.status == 101


def test_without_the_token(target: Target) -> None:
    wrong = "A" * len(target.token)
    for path in (
        "/",
        "/index.html",
        f"/{wrong}/",
        f"/{target.token[:-1]}/",
        f"/x/{target.token}/",
        f"/?token={target.token}",
        f"/{wrong}/?{target.token}",
        f"//{target.token}/",
        f"http://{target.host}/{target.token}/",
        f"/{target.token}%2f",
        "/pick/1",
        "/files/results/report.html",
        "*",
    ):
        assert_refused(target.ask(path), target)
    assert_refused(target.ask("/", f"Cookie: token={target.token}", f"Authorization: {target.token}"), target)
    own = f"Origin: http://{target.host}"
    for path in ("/", f"/{wrong}", f"/?token={target.token}"):
        assert_refused(target.ask(path, *UPGRADE, protocol(), own), target)


def test_a_websocket_of_another_site_with_the_right_token(target: Target) -> None:
    port = urlsplit(target.url).port
    for origin in (
        "https://evil.example",
        "null",
        f"http://127.0.0.1:{port}.evil.example",
        "http://127.0.0.1:1",
        "http://localhost",
        f"https://127.0.0.1:{port}",
    ):
        assert_refused(target.ask(f"/{target.token}", *UPGRADE, protocol(), f"Origin: {origin}"), target)
        assert_refused(target.ask(f"/{target.token}/", f"Origin: {origin}"), target)
    assert_refused(target.ask(f"/{target.token}", *UPGRADE, protocol()), target)


@pytest.mark.parametrize("word", ["WebSocket", "WEBSOCKET", "websocket, h2c", "h2c", ""])
def test_upgrades_spelt_differently_are_no_way_around(target: Target, word: str) -> None:
    upgrade = [f"Upgrade: {word}", *UPGRADE[1:], protocol()]
    for origin in ([], ["Origin: https://evil.example"]):
        assert_refused(target.ask(f"/{target.token}", *upgrade, *origin), target)
        assert_refused(target.ask("/", *upgrade, *origin), target)


def test_other_names_of_this_machine(target: Target) -> None:
    """DNS rebinding: the browser believes the page to be evil.example's, and says so."""
    port = urlsplit(target.url).port
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{port}@evil.example", " "):
        assert_refused(target.ask(f"/{target.token}/", host=host), target)
        rebound = (*UPGRADE, protocol(), f"Origin: http://{host}")
        assert_refused(target.ask(f"/{target.token}", *rebound, host=host), target)
    assert_refused(target.ask(f"/{target.token}/", f"Host: {target.host}", host="evil.example"), target)
    assert_refused(target.ask(f"/{target.token}/", "Host: evil.example"), target)


def test_pages_of_other_sites_that_load_or_embed_it(target: Target) -> None:
    for site in ("cross-site", "same-site"):
        loads = [f"Sec-Fetch-Site: {site}", "Sec-Fetch-Mode: no-cors", "Sec-Fetch-Dest: image"]
        embeds = [f"Sec-Fetch-Site: {site}", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: iframe"]
        leads = [f"Sec-Fetch-Site: {site}", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: document"]
        assert_refused(target.ask(f"/{target.token}/", *loads), target)
        assert_refused(target.ask(f"/{target.token}/", *embeds), target)
        assert_refused(target.ask(f"/{target.token}/pick/1", *leads), target)


@pytest.mark.parametrize(
    "path",
    [
        "../other.yaml",
        "results/../../other.yaml",
        "%2e%2e/other.yaml",
        "%2e%2e%2fother.yaml",
        "..%2fother.yaml",
        "..%5cother.yaml",
        "..\\other.yaml",
        "%252e%252e/other.yaml",
        "../project2/page.html",
        "//etc/passwd.yaml",
        "/{folder}/../other.yaml",
        "%2f{folder}%2f..%2fother.yaml",
        "{folder}/results/report.html",
        "//{folder}/results/report.html",
        "other.yaml%00.html",
        "results/report.html%00",
        "results/report.html%0d%0aX:%20y",
        "link.yaml",
        "away/page.html",
        "code.py",
        "code.html",
        ".hidden.yaml",
        ".git/config.yaml",
        "./results/report.html",
        "results//report.html",
        "results/report.html/",
        "results",
        "results/",
        "",
        "folder.html",
        "pipe.csv",
        "%ff.html",
        "absent.html",
        "CON.html",
        "a" * 300 + ".html",
        "results/report.HTML",
    ],
)
def test_paths_that_leave_the_folder_or_are_no_results(target: Target, path: str) -> None:
    """Neither the route nor viser's own server of files answers."""
    path = path.format(folder=target.folder)
    reply = target.file(path)
    assert reply.status == 404 and SECRET.encode() not in reply.body, reply
    direct = target.ask(f"/{target.token}/{path}")
    if path:
        assert direct.status in (302, 404) and SECRET.encode() not in direct.body, direct


def test_pages_of_the_folder_are_in_a_sandbox(target: Target) -> None:
    """Anybody's page: it has an origin of its own, can load and send nothing, and an address that opens files alone."""
    for path, kind in (
        ("results/report.html", "text/html; charset=utf-8"),
        ("inside.html", "text/html; charset=utf-8"),
        ("poses%20%C3%A9.csv", "text/plain; charset=utf-8"),
        ("arm.urdf", "text/plain; charset=utf-8"),
    ):
        reply = target.file(path)
        assert reply.status == 200 and reply.headers["content-type"] == kind
        policy = reply.headers["content-security-policy"]
        assert policy.startswith("sandbox allow-scripts") and "default-src 'none'" in policy
        assert "allow-same-origin" not in policy and "connect-src" not in policy
        assert reply.headers["x-content-type-options"] == "nosniff"
    page = target.ask(f"/{target.token}/files/results/report.html").headers["location"]
    token = page.split("/")[1]
    assert target.ask(page + "?a=1").status == 200
    for path in (
        "",
        "/",
        "/pick/1",
        "/files",
        "/files/",
        "/files/inside.html",
        "/files/results/../inside.html",
    ):
        assert_refused(target.ask(f"/{token}{path}"), target)
    assert_refused(target.ask(page, *UPGRADE, protocol(), f"Origin: http://{target.host}"), target)


def test_requests_that_are_no_requests(target: Target) -> None:
    """The server hangs up, and serves others."""
    host = f"Host: {target.host}\r\n".encode()
    page = f"/{target.token}/".encode()
    for method in (b"POST", b"PUT", b"DELETE", b"OPTIONS", b"HEAD", b"CONNECT"):
        reply = target.send(method + b" " + page + b" HTTP/1.1\r\n" + host + b"\r\n")
        assert not reply.startswith(b"HTTP/1.1 2"), method
    for request in (
        b"GET " + page + b" HTTP/1.0\r\n" + host + b"\r\n",
        b"GET " + page + b" HTTP/1.1\r\n" + host + b"X: " + b"y" * 100_000 + b"\r\n\r\n",
        b"GET " + page + b" HTTP/1.1\r\n" + host + 1000 * b"X: y\r\n" + b"\r\n",
        b"GET " + page + b"x" * 100_000 + b" HTTP/1.1\r\n" + host + b"\r\n",
        b"GET " + page + b" HTTP/1.1\r\n" + host + b"Content-Length: 5\r\n\r\nhello",
        b"GET " + page + b" HTTP/1.1\r\n" + host + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        b"GET " + page + b" HTTP/1.1\r\n" + host + b"X: \x00\r\n\r\n",
        b"GET " + page + b"files/a\rX:y HTTP/1.1\r\n" + host + b"\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + os.urandom(200) + b"\r\n\r\n",
        b"\r\n\r\n",
    ):
        reply = target.send(request)
        assert not reply.startswith((b"HTTP/1.1 2", b"HTTP/1.1 101")), request[:60]
    assert_refused(target.ask(f"/{target.token}/\xff"), target)
    assert target.ask(f"/{target.token}/").status == 200


def test_connections_that_say_nothing_hinder_nobody(target: Target) -> None:
    """A request is answered while they are still waited for, which ends after a while: on a slow machine before the answer, so again."""
    for _ in range(10):
        with ExitStack() as stack:
            silent = [stack.enter_context(target.connect()) for _ in range(200)]
            for connection in silent[::2]:
                connection.sendall(f"GET /{target.token}/ HTTP/1.1\r\nHost: ".encode())
            assert target.ask(f"/{target.token}/").status == 200
            are_open = [is_open(silent[0]), is_open(silent[-1])]
            silent[0].settimeout(PATIENCE)
            assert silent[0].recv(1) == b""  # these are closed by and by
        if all(are_open):
            return
    raise AssertionError("answered only when they had been closed")


def is_open(connection: socket.socket) -> bool:
    """Whether the server has neither closed it nor said anything."""
    connection.setblocking(False)
    try:
        connection.recv(1)
    except BlockingIOError:
        return True
    return False


def test_other_addresses_of_this_machine_are_not_served(target: Target) -> None:
    with pytest.raises(OSError):
        target.connect("127.0.0.2").close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return
        address = probe.getsockname()[0]
    if address != "127.0.0.1":
        with pytest.raises(OSError):
            target.connect(address).close()


@pytest.mark.parametrize("text", ["%5B" * 20_000, "%7B%22once%22:" * 2000, "{}", "null", "NaN", "%22", ""])
def test_entries_that_are_none(target: Target, text: str) -> None:
    reply = target.ask(f"/{target.token}/enter/{text}")
    assert reply.status in (0, 400) and target.ask(f"/{target.token}/").status == 200


def test_garbage_on_an_open_websocket(target: Target) -> None:
    """Of someone who has the token, and so may do it: the connection ends, the server does not."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync import client

    url = f"ws://{target.host}/{target.token}"
    subprotocols = [f"viser-v{viser.__version__}"]
    for garbage in (
        "text",
        b"",
        b"\xff" * 100,
        *(os.urandom(100) for _ in range(20)),
        b"\x81\xa4type\xa7NoClass",
    ):
        with client.connect(url, origin=f"http://{target.host}", subprotocols=subprotocols) as connection:
            connection.send(garbage)
            with pytest.raises(ConnectionClosed):
                while True:
                    connection.recv(PATIENCE)
    assert target.ask(f"/{target.token}/").status == 200


def test_picks_of_poses_that_are_none(target: Target) -> None:
    for key in ("12", "-1", "%3Cscript%3E", "1/2", "a" * 4000, "%00", "%F0%9F%A4%96"):
        assert target.ask(f"/{target.token}/pick/{key}").status == 204, key
    assert target.ask(f"/{target.token}/pick/%ff").status == 404
    assert target.ask(f"/{target.token}/").status == 200


class Tunnel:
    """In place of viser's way to share.viser.studio: counts who asked for it, and fails."""

    opened = 0

    def __init__(self, *arguments: object) -> None:
        Tunnel.opened += 1
        self.on_connect = self.on_disconnect = lambda callback: callback

    def get_status(self) -> str:
        return "failed"

    def close(self) -> None:
        pass


def test_nobody_is_served_through_somebody_elses_machine(tmp_path: Path, monkeypatch: Any) -> None:
    """A client with the token asks for viser's public address, and no tunnel is dug; by viser as it comes, it is."""
    import viser._viser

    monkeypatch.setattr(viser._viser, "ViserTunnel", Tunnel)
    plain = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        with sharing(f"ws://127.0.0.1:{plain.get_port()}", "http://127.0.0.1"):
            until(lambda: Tunnel.opened)
    finally:
        plain.stop()
    assert Tunnel.opened == 1
    server = StudioServer.start("127.0.0.1", 0, {}, ProjectFiles(tmp_path))
    seen_to: list[str] = []
    for name in ("request_share_url", "disconnect_share_url"):
        monkeypatch.setattr(server.viser, name, noted(getattr(server.viser, name), seen_to))
    try:
        place = urlsplit(server.url)
        with sharing(f"ws://{place.netloc}{place.path}", f"http://{place.netloc}"):
            until(lambda: len(seen_to) == 2)
    finally:
        server.stop()
    assert Tunnel.opened == 1


def noted(action: Any, names: list[str]) -> Any:
    """The action, whose name is noted once it has been carried out."""

    def act() -> Any:
        try:
            return action()
        finally:
            names.append(action.__name__)

    return act


@contextmanager
def sharing(url: str, origin: str) -> Iterator[None]:
    """A client that has asked for the tunnel, and for its end."""
    import msgspec
    from viser._messages import ShareUrlDisconnect, ShareUrlRequest
    from websockets.sync.client import connect

    with connect(url, origin=origin, subprotocols=[f"viser-v{viser.__version__}"]) as connection:
        for message in (ShareUrlRequest(), ShareUrlDisconnect()):
            connection.send(msgspec.msgpack.encode(message.as_serializable_dict([])))
        yield


def test_a_viser_that_goes_around_the_gate_is_not_started(tmp_path: Path, monkeypatch: Any) -> None:
    """Where another version calls the server by another way, or does not ask the gate, the studio refuses to run."""
    from types import SimpleNamespace

    import viser.infra._infra as infra
    import websockets.asyncio.server

    from flexcal.studio.server import gated_viser

    def assert_not_started() -> None:
        with refused("E-STUDIO-002", viser.__version__):
            StudioServer.start("127.0.0.1", 0, {}, ProjectFiles(tmp_path))

    before = websockets.asyncio.server.serve
    with monkeypatch.context() as patch:
        patch.setattr(gated_viser, "_gated", lambda site, inner: inner)
        assert_not_started()
    with monkeypatch.context() as patch:
        own = SimpleNamespace(
            asyncio=SimpleNamespace(server=SimpleNamespace(serve=before)),
            datastructures=infra.websockets.datastructures,
            exceptions=infra.websockets.exceptions,
        )
        patch.setattr(infra, "websockets", own)
        assert_not_started()
    assert websockets.asyncio.server.serve is before


def test_a_machine_that_was_asleep_is_no_open_door(tmp_path: Path, monkeypatch: Any) -> None:
    """The studio asks itself whether it keeps others out; an answer that is late is waited for again."""
    response, calls = http.client.HTTPConnection.getresponse, iter(range(100))

    def late(connection: http.client.HTTPConnection) -> http.client.HTTPResponse:
        if next(calls) in (0, 2):
            raise TimeoutError
        return response(connection)

    monkeypatch.setattr(http.client.HTTPConnection, "getresponse", late)
    StudioServer.start("127.0.0.1", 0, {}, ProjectFiles(tmp_path)).stop()
    assert next(calls) == 5


def test_a_port_that_is_taken(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    first = StudioServer.start("127.0.0.1", 0, {}, ProjectFiles(tmp_path))
    port = urlsplit(first.url).port
    try:
        assert port and port != 1 and first.viser.get_port() == port
        with refused("E-STUDIO-004", str(port)):
            StudioServer.start("127.0.0.1", port, {}, ProjectFiles(tmp_path))
        second = StudioServer.start("127.0.0.1", None, {}, ProjectFiles(tmp_path))
        assert urlsplit(second.url).port != port
        second.stop()
    finally:
        first.stop()
    again = StudioServer.start("127.0.0.1", port, {}, ProjectFiles(tmp_path))
    again.stop()
