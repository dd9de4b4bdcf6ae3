"""The window in a real browser."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit


def test_window_opens_and_talks_to_this_server_alone(page: Any, studio_url: str) -> None:
    """The page is drawn under its Content-Security-Policy: no error, no violation, no request to anywhere else."""
    requests, errors, sockets = [], [], []
    page.on("request", lambda request: requests.append(request.url))
    page.on("websocket", lambda socket: sockets.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    response = page.goto(studio_url)
    assert response.status == 200 and "default-src 'none'" in response.headers["content-security-policy"]
    page.get_by_text("Robot").first.wait_for(timeout=15_000)
    page.locator("canvas").first.wait_for(timeout=15_000)
    page.wait_for_function(
        "[...document.querySelectorAll('canvas')].some(c => c.width > 300 && c.getContext('webgl2'))",
        timeout=15_000,
    )
    page.wait_for_timeout(1000)
    assert errors == []
    place = urlsplit(studio_url).netloc
    foreign = [url for url in [*requests, *sockets] if urlsplit(url).scheme in ("http", "https", "ws", "wss")]
    assert foreign and {urlsplit(url).netloc for url in foreign} == {place} and len(sockets) >= 1
