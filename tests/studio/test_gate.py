"""Who is let in, decided on path and headers alone."""

from __future__ import annotations

import pytest

from flexcal.studio.server.gate import Gate, own_hosts

TOKEN, SECRET = "t" * 43, b"s" * 32
GATE = Gate(TOKEN, SECRET, own_hosts(["127.0.0.1", "localhost", "::1"], 8080), 8080)
PAGE = GATE.page_token("files/report.html")
HOST = ("Host", "127.0.0.1:8080")
ORIGIN = ("Origin", "http://127.0.0.1:8080")
UPGRADE = ("Upgrade", "websocket")


def test_own_page_and_websocket_are_let_in() -> None:
    page = GATE.passage(f"/{TOKEN}/pick/12?a=1", [HOST])
    assert page is not None and (page.path, page.key, page.upgrade) == ("pick/12?a=1", "token", False)
    socket = GATE.passage(f"/{TOKEN}", [HOST, ORIGIN, UPGRADE])
    assert socket is not None and socket.upgrade
    bare = GATE.passage(f"/{TOKEN}", [HOST])
    assert bare is not None and bare.path is None
    page = GATE.passage(f"/{PAGE}/files/report.html?a=1", [HOST])
    assert page is not None and page.key == "page_token" and page.path == "files/report.html?a=1"


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "LOCALHOST:8080", "[::1]:8080"])
def test_hosts_of_this_machine(host: str) -> None:
    passage = GATE.passage(f"/{TOKEN}/", [("host", host), ("origin", f"http://{host}")])
    assert passage is not None and passage.host == host.lower()


@pytest.mark.parametrize(
    "target",
    [
        "/",
        "",
        "*",
        f"/{'x' * 43}/",
        f"/{TOKEN[:-1]}/",
        f"/{TOKEN}t/",
        f"/{TOKEN.upper()}/",
        f"//{TOKEN}/",
        f"/x/{TOKEN}/",
        f"/?token={TOKEN}",
        f"/#{TOKEN}/",
        f"/./{TOKEN}/",
        f"/%74{TOKEN[1:]}/",
        f"http://127.0.0.1:8080/{TOKEN}/",
        f"/{TOKEN}\udcff/",
        f"/{TOKEN}/\udcff",
        f"/{TOKEN}/\r",
        f"/{TOKEN}/\x00",
    ],
)
def test_token_must_be_the_first_name_of_the_path(target: str) -> None:
    assert GATE.passage(target, [HOST]) is None


@pytest.mark.parametrize(
    "headers",
    [
        [],
        [("Host", "evil.example")],
        [("Host", "evil.example:8080")],
        [("Host", "127.0.0.1")],
        [("Host", "127.0.0.1:8081")],
        [("Host", "127.0.0.1:8080.evil.example")],
        [("Host", "127.0.0.1:8080@evil.example")],
        [("Host", "127.0.0.2:8080")],
        [HOST, ("host", "evil.example")],
        [HOST, HOST],
    ],
)
def test_other_names_are_refused(headers: list[tuple[str, str]]) -> None:
    assert GATE.passage(f"/{TOKEN}/", headers) is None


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "",
        "http://evil.example",
        "http://127.0.0.1",
        "http://127.0.0.1:8081",
        "https://127.0.0.1:8080",
        "http://127.0.0.1:8080.evil.example",
        "http://evil.example/http://127.0.0.1:8080",
        "127.0.0.1:8080",
        "file://",
    ],
)
def test_other_origins_are_refused(origin: str) -> None:
    for more in ([], [UPGRADE]):
        assert GATE.passage(f"/{TOKEN}", [HOST, ("Origin", origin), *more]) is None


@pytest.mark.parametrize(
    "upgrade", [("Upgrade", "WebSocket"), ("upgrade", "h2c"), ("Sec-WebSocket-Key", "a")]
)
def test_upgrades_need_an_origin_however_they_are_spelt(upgrade: tuple[str, str]) -> None:
    assert GATE.passage(f"/{TOKEN}", [HOST, upgrade]) is None
    passage = GATE.passage(f"/{TOKEN}", [HOST, ORIGIN, upgrade])
    assert passage is not None and passage.upgrade


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_other_pages_may_lead_here_and_no_more(site: str) -> None:
    foreign = [HOST, ("Sec-Fetch-Site", site)]
    leads = [*foreign, ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "document")]
    embeds = [*foreign, ("Sec-Fetch-Mode", "navigate"), ("Sec-Fetch-Dest", "iframe")]
    loads = [*foreign, ("Sec-Fetch-Mode", "no-cors"), ("Sec-Fetch-Dest", "image")]
    assert GATE.passage(f"/{TOKEN}/", leads) is not None
    assert GATE.passage(f"/{TOKEN}/pick/12", leads) is None
    for headers in (foreign, embeds, loads):
        assert GATE.passage(f"/{TOKEN}/", headers) is None
    assert GATE.passage(f"/{TOKEN}/", [*leads, ORIGIN, UPGRADE]) is None


@pytest.mark.parametrize(
    "path",
    [
        "files/other.html",
        "files/report.html/",
        "files/./report.html",
        "files/%72eport.html",
        "files/",
        "files",
    ],
)
def test_token_of_a_page_opens_no_other(path: str) -> None:
    assert GATE.passage(f"/{PAGE}/{path}", [HOST]) is None
    assert GATE.passage(f"/{GATE.page_token(path)}/files/report.html", [HOST]) is None


def test_token_of_a_page_opens_neither_window_nor_websocket() -> None:
    for path in ("", "/", "/pick/1", "?files/report.html", "/?files/report.html"):
        assert GATE.passage(f"/{PAGE}{path}", [HOST]) is None
    assert GATE.passage(f"/{GATE.page_token('pick/1')}/pick/1", [HOST]) is None
    assert GATE.passage(f"/{PAGE}/files/report.html", [HOST, ORIGIN, UPGRADE]) is None


def test_any_address_but_no_other_name_where_all_interfaces_are_served() -> None:
    gate = Gate(TOKEN, SECRET, own_hosts(["cell-pc"], 8080), 8080, any_address=True)
    for host in ("192.168.1.7:8080", "[fe80::1]:8080", "cell-pc:8080"):
        assert gate.passage(f"/{TOKEN}/", [("Host", host)]) is not None, host
    for host in (
        "192.168.1.7:80",
        "evil.example:8080",
        "1.2.3.4.evil.example:8080",
        "x@192.168.1.7:8080",
        "",
    ):
        assert gate.passage(f"/{TOKEN}/", [("Host", host)]) is None, host


def test_the_port_80_is_left_out_by_browsers() -> None:
    assert own_hosts(["localhost", "::1"], 80) == {"localhost:80", "localhost", "[::1]:80", "[::1]"}


def test_tokens_are_not_in_the_text_of_a_gate() -> None:
    assert TOKEN not in repr(GATE) and "sss" not in repr(GATE)
