"""Who may speak to an open notebook: its own page, on this machine, with its token; no other page of the same browser.

A page of any site can open a socket to 127.0.0.1, and a site can give its own name that address (DNS rebinding). So the
name in `Host` must be one of this server's, `Origin` must be the page that the server itself sent, and what a browser
fetches for another site is refused; the token, which marimo asks for, keeps out whoever sends neither. Sockets are
counted: each of them may start a notebook of some 50 MB. A secret address, which only its pages know, stops what they
are working out: marimo has no button for it outside its editor.
"""

import ipaddress
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from capture_plan.progress import stop_work

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
MOST_SOCKETS = 12
HEADERS = (
    (b"x-frame-options", b"SAMEORIGIN"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),  # the address holds the token
    (b"cross-origin-resource-policy", b"same-origin"),
)


class Guard:
    """`app`, an ASGI application served at `host` and `port`, for its own pages alone."""

    stop_path = ""  # where a page asks for the end of the work; nowhere until a session is served

    def __init__(self, app: App, host: str, port: int) -> None:
        self.app, self.host, self.port, self.sockets = app, host.strip("[]"), port, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or refuse before the application hears of it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif reason := self.refusal(scope):
            await refuse(scope["type"], reason, receive, send)
        elif scope["type"] == "websocket":
            self.sockets += 1
            try:
                await self.app(scope, receive, send)
            finally:
                self.sockets -= 1
        elif self.stop_path and scope["path"] == self.stop_path:
            stop_work()
            await send({"type": "http.response.start", "status": 204, "headers": []})  # the page stays as it is
            await send({"type": "http.response.body"})
        else:
            await self.app(scope, receive, with_headers(send))

    def refusal(self, scope: Scope) -> str | None:
        """Why a request is refused; None where it is not."""
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        host = headers.get("host", "")
        if not self.is_mine(host):
            return "this server does not go by that name"
        if (origin := headers.get("origin")) is not None and origin not in (f"http://{host}", f"https://{host}"):
            return "another page may not ask this server"
        opened = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) == ("navigate", "document")
        if headers.get("sec-fetch-site") in ("cross-site", "same-site") and not opened:
            return "another page may not ask this server"
        if scope["type"] == "websocket" and self.sockets >= MOST_SOCKETS:
            return f"{MOST_SOCKETS} windows of this notebook are open: close one"
        return None

    def is_mine(self, host: str) -> bool:
        """Whether a `Host` header names this server."""
        name, _, port = host.rpartition(":") if host.rpartition(":")[2].isdigit() else (host, "", "80")
        name = name.strip("[]").lower()
        if port != str(self.port):
            return False
        return name in (self.host, *LOOPBACK) if self.host in LOOPBACK else name in names_here() or is_address(name)


def with_headers(send: Send) -> Send:
    """`send`, with our headers on every answer."""

    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *HEADERS]
        await send(message)

    return sent


async def refuse(kind: str, reason: str, receive: Receive, send: Send) -> None:
    """403 with one line; a socket is closed before it opens."""
    if kind == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    await send({"type": "http.response.start", "status": 403, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": f"{reason}\n".encode()})


def names_here() -> tuple[str, ...]:
    """What this machine is called, for a server that others may reach."""
    name = socket.gethostname().lower()
    return (*LOOPBACK, name, name.partition(".")[0], socket.getfqdn().lower())


def is_address(name: str) -> bool:
    """Whether a name is a plain address, which no site can take for itself."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
