"""viser's page under a policy by which it runs its own scripts and no others, whatever markup gets into it."""

from __future__ import annotations

import re
import secrets

from flexcal.studio.server.answer import Answer

_PASS_ON = (
    "{{const make=document.createElement;document.createElement=function(...given){{const made=make.apply(this,given);"
    'if(made instanceof HTMLScriptElement)made.nonce="{nonce}";return made}}}}'
)
"""viser's page unpacks its program into a script element that it creates: scripts that a script creates are trusted as it is."""

_HOLD_CLICKS = (
    "{let typed=-1e9;addEventListener('input',()=>{typed=performance.now()},true);addEventListener('click',event=>{"
    "const button=event.target.closest?.('button'),left=typed+100-performance.now();if(button&&event.isTrusted&&left>0){"
    "event.stopPropagation();event.preventDefault();setTimeout(()=>button.click(),left)}},true)}"
)
"""viser sends at most one message of its fields and buttons in 50 ms, the last: a button that is pressed just after a number was typed, or
while a busy page has not looked at the number yet, would be sent in its place."""


def window_page(page: bytes, host: str) -> Answer:
    """The page that viser serves, sent to `host`, with a nonce that only the scripts in it have.

    It may also run code that Plotly makes and WebAssembly, and talk to the server that it came from. Handlers and scripts in HTML that
    is added later do not run, and nothing is loaded from elsewhere.
    """
    nonce = secrets.token_urlsafe(18)
    marked = re.sub(rb"<script(?=[\s>])", f'<script nonce="{nonce}"'.encode(), page)
    first = f'<script nonce="{nonce}">{_PASS_ON.format(nonce=nonce)}{_HOLD_CLICKS}</script>'.encode()
    whole = marked.replace(b"<head>", b"<head>" + first, 1)
    policy = (
        f"default-src 'none'; script-src 'nonce-{nonce}' 'unsafe-eval' blob:; style-src 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src data:; media-src data: blob:; connect-src 'self' ws://{host} data: blob:; "
        "worker-src blob: data:; base-uri 'none'; form-action 'none'; object-src 'none'; frame-ancestors 'none'"
    )
    return Answer(200, "text/html; charset=utf-8", whole, policy)
