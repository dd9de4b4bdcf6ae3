"""viser's page under a policy by which it runs its own scripts and no others, whatever markup gets into it."""

from __future__ import annotations

import re
import secrets
from pathlib import Path

from flexcal.studio.server.answer import Answer

_OURS = Path(__file__).with_name("page.js").read_text("utf-8")


def window_page(page: bytes, host: str) -> Answer:
    """The page that viser serves, sent to `host`, with a nonce that only the scripts in it have.

    It may also run code that Plotly makes and WebAssembly, and talk to the server that it came from. Handlers and scripts in HTML that
    is added later do not run, and nothing is loaded from elsewhere.
    """
    nonce = secrets.token_urlsafe(18)
    marked = re.sub(rb"<script(?=[\s>])", f'<script nonce="{nonce}"'.encode(), page)
    first = f'<script nonce="{nonce}">{_OURS}</script>'.encode()
    whole = marked.replace(b"<head>", b"<head>" + first, 1)
    policy = (
        f"default-src 'none'; script-src 'nonce-{nonce}' 'unsafe-eval' blob:; style-src 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src data:; media-src data: blob:; connect-src 'self' ws://{host} data: blob:; "
        "worker-src blob: data:; base-uri 'none'; form-action 'none'; object-src 'none'; frame-ancestors 'none'"
    )
    return Answer(200, "text/html; charset=utf-8", whole, policy)
