"""Who is let in, decided on path and headers alone."""

from __future__ import annotations

import pytest

from flexcal.studio.server.gate import Gate, own_hosts

TOKEN, FILES, TICKET = "t" * 43, "f" * 43, "k" * 43
GATE = Gate(TOKEN, FILES, TICKET, own_hosts(["127.0.0.1", "localhost", "::1"], 8080), 8080)
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
    files = GATE.passage(f"/{FILES}/files/report.html", [HOST])
    assert files is not None and files.key == "files_token" and files.path == "files/report.html"


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


def test_token_of_files_and_ticket_open_no_websocket() -> None:
    for token in (FILES, TICKET):
        assert GATE.passage(f"/{token}", [HOST, ORIGIN, UPGRADE]) is None


def test_ticket_is_told_from_the_token() -> None:
    ticket = GATE.passage(f"/{TICKET}/", [HOST])
    assert ticket is not None and ticket.key == "ticket"


def test_any_address_but_no_other_name_where_all_interfaces_are_served() -> None:
    gate = Gate(TOKEN, FILES, TICKET, own_hosts(["cell-pc"], 8080), 8080, any_address=True)
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
    assert not [token for token in (TOKEN, FILES, TICKET) if token in repr(GATE)]
