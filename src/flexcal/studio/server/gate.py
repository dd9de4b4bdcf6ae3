"""Who may talk to the server: a pure decision on path and headers of a request."""

from __future__ import annotations

import base64
import hmac
import ipaddress
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal
from urllib.parse import urlsplit

Key = Literal["token", "page_token"]
FILES = "files"
"""First name of the paths of the project's files."""


@dataclass(frozen=True)
class Passage:
    """A request that is let in: the `path` behind the token, with its query and without a leading slash, and the `host` it was sent to.

    `key` is what opened; `upgrade` whether it asks for a websocket. `path` is None where even the slash behind the token is missing.
    """

    path: str | None
    host: str
    key: Key = "token"
    upgrade: bool = False


@dataclass(frozen=True)
class Gate:
    """Lets in requests whose path begins with a token, and that were sent to an allowed host by nobody else's page.

    Parameters
    ----------
    token : str
        Opens everything.
    page_secret : bytes
        What the tokens of files of the project are made with. A page among them may be anybody's: it knows its own address, hence
        neither `token` nor what opens another file.
    hosts : frozenset of str
        Allowed `Host` headers, as `127.0.0.1:8080`, in lower case. Other names are those of DNS rebinding.
    port : int
        Of the server.
    any_address : bool
        Whether every IP address with that port is allowed too, for a server that listens on all interfaces; rebinding needs a name.
    """

    token: str = field(repr=False)
    page_secret: bytes = field(repr=False)
    hosts: frozenset[str]
    port: int
    any_address: bool = False

    def page_token(self, path: str) -> str:
        """The token that opens one path below FILES, as it is in the request, without its query."""
        digest = hmac.digest(self.page_secret, path.encode(), "sha256")
        return base64.urlsafe_b64encode(digest).decode().rstrip("=")

    def passage(self, target: str, headers: Iterable[tuple[str, str]]) -> Passage | None:
        """What a request of a path and headers may have; None where it is to be refused."""
        values: dict[str, list[str]] = {}
        for name, value in headers:
            values.setdefault(name.lower(), []).append(value.strip())
        if any(len(values.get(name, ())) > 1 for name in _SINGLE):
            return None
        single = {name: values[name][0] for name in _SINGLE if name in values}
        host = single.get("host", "").lower()
        upgrade = "upgrade" in values or any(name.startswith("sec-websocket-") for name in values)
        found = self._behind_token(target)
        if found is None or not self._is_own(host):
            return None
        path, key = found
        origin = single.get("origin")
        if origin is None:
            if upgrade:
                return None
        elif not self._is_own_origin(origin):
            return None
        if key != "token" and upgrade:
            return None
        if single.get("sec-fetch-site", "none").lower() not in ("none", "same-origin"):
            to_page = key == "page_token" or not path or path.startswith("?")
            if upgrade or not to_page or not _is_navigation(single):
                return None
        return Passage(path, host, key, upgrade)

    def _behind_token(self, target: str) -> tuple[str | None, Key] | None:
        """The path behind a token, and which one it was."""
        if not target.startswith("/") or not (target.isascii() and target.isprintable()):
            return None
        given, slash, rest = target[1:].partition("/")
        given, question, query = given.partition("?")
        if question:  # /TOKEN?query has no slash behind the token
            slash, rest = "", f"?{query}"
        path = rest if slash else None
        if hmac.compare_digest(given.encode(), self.token.encode()):
            return path, "token"
        name = rest.partition("?")[0]
        if slash and name.startswith(f"{FILES}/") and hmac.compare_digest(given, self.page_token(name)):
            return path, "page_token"
        return None

    def _is_own(self, host: str) -> bool:
        if host in self.hosts:
            return True
        if not self.any_address:
            return False
        try:
            parts = urlsplit(f"http://{host}")
            ipaddress.ip_address(parts.hostname or "")
            return parts.netloc == host and (parts.port or 80) == self.port and "@" not in host
        except ValueError:
            return False

    def _is_own_origin(self, origin: str) -> bool:
        scheme, separator, host = origin.lower().partition("://")
        return scheme == "http" and bool(separator) and self._is_own(host)


_SINGLE = ("host", "origin", "sec-fetch-site", "sec-fetch-mode", "sec-fetch-dest", "upgrade")
"""Headers that a request has once at most; twice, two programs may read two different ones."""


def _is_navigation(headers: dict[str, str]) -> bool:
    """Whether a window goes to the page, as by a link in a mail, rather than another page that loads or embeds it."""
    return (
        headers.get("sec-fetch-mode", "").lower() == "navigate"
        and headers.get("sec-fetch-dest", "").lower() == "document"
    )


def own_hosts(names: Iterable[str], port: int) -> frozenset[str]:
    """`Host` headers of names and addresses with a port, which browsers leave out where it is 80."""
    hosts = set()
    for name in names:
        bracketed = f"[{name}]" if ":" in name else name
        hosts.add(f"{bracketed}:{port}".lower())
        if port == 80:
            hosts.add(bracketed.lower())
    return frozenset(hosts)
