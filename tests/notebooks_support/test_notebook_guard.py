"""An open notebook answers its own page alone."""

import asyncio
import socket
from concurrent.futures import ThreadPoolExecutor

import pytest

from capture_plan.errors import RigError
from capture_plan.notebook import check_address
from capture_plan.notebook_guard import MOST_SOCKETS, Guard
from capture_plan.progress import StoppedError, go_on, stoppable


def answer(guard, kind="http", path="/", **headers):
    """What a request with these headers is answered: a status, or what happens to a socket."""
    sent = []

    async def receive():
        return {"type": f"{kind}.connect"}

    async def send(message):
        sent.append(message)

    named = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    asked = guard({"type": kind, "path": path, "headers": named}, receive, send)
    with ThreadPoolExecutor(1) as thread:  # a browser that another test opened has a loop in this one
        thread.submit(asyncio.run, asked).result()
    return sent[0].get("status", sent[0]["type"])


async def hello(scope, receive, send):
    """An application that answers everybody."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
    else:
        await send({"type": "http.response.start", "status": 200, "headers": []})


LOCAL = Guard(hello, "127.0.0.1", 2718)
OPEN = Guard(hello, "0.0.0.0", 2718)


@pytest.mark.parametrize(
    ("kind", "yes", "no"), [("http", 200, 403), ("websocket", "websocket.accept", "websocket.close")]
)
@pytest.mark.parametrize(
    ("guard", "headers", "answered"),
    [
        (LOCAL, {"host": "127.0.0.1:2718"}, True),
        (LOCAL, {"host": "localhost:2718", "origin": "http://localhost:2718"}, True),
        (LOCAL, {"host": "[::1]:2718"}, True),
        (LOCAL, {"host": "localhost:2718", "sec_fetch_site": "same-origin"}, True),
        (LOCAL, {"host": "localhost:2718", "origin": "http://other.example"}, False),
        (LOCAL, {"host": "localhost:2718", "origin": "http://localhost:9999"}, False),
        (LOCAL, {"host": "localhost:2718", "origin": "null"}, False),
        (LOCAL, {"host": "localhost:2718", "sec_fetch_site": "cross-site", "sec_fetch_dest": "image"}, False),
        (LOCAL, {"host": "rebound.example:2718"}, False),
        (LOCAL, {"host": "rebound.example:2718", "origin": "http://rebound.example:2718"}, False),
        (LOCAL, {"host": "127.0.0.1.rebound.example:2718"}, False),
        (LOCAL, {"host": "192.168.0.7:2718"}, False),
        (LOCAL, {"host": "localhost:9999"}, False),
        (LOCAL, {}, False),
        (OPEN, {"host": "192.168.0.7:2718"}, True),
        (OPEN, {"host": "rebound.example:2718"}, False),
    ],
)
def test_only_its_own_page_is_answered(guard, kind, yes, no, headers, answered):
    assert answer(guard, kind, **headers) == (yes if answered else no)


def test_a_link_from_elsewhere_may_open_the_page():
    link = {"sec_fetch_site": "cross-site", "sec_fetch_mode": "navigate", "sec_fetch_dest": "document"}
    assert answer(LOCAL, host="localhost:2718", **link) == 200


def test_windows_are_counted_and_free_again_when_they_close():
    guard = Guard(hello, "127.0.0.1", 2718)
    for _ in range(MOST_SOCKETS + 1):
        assert answer(guard, "websocket", host="localhost:2718") == "websocket.accept"
    guard.sockets = MOST_SOCKETS
    assert answer(guard, "websocket", host="localhost:2718") == "websocket.close"


def test_only_the_secret_address_stops_what_is_worked_out_and_the_page_stays(monkeypatch):
    monkeypatch.setattr(LOCAL, "stop_path", "/stop/secret")
    with stoppable():
        assert answer(LOCAL, path="/stop/guessed", host="localhost:2718") == 200
        assert answer(LOCAL, path="/stop/secret", host="rebound.example:2718") == 403
        go_on()
        assert answer(LOCAL, path="/stop/secret", host="localhost:2718") == 204
        with pytest.raises(StoppedError):
            go_on()


def test_nobody_stops_anything_where_no_session_is_served():
    assert not Guard.stop_path
    with stoppable():
        assert answer(LOCAL, path="", host="localhost:2718") == 200
        go_on()


@pytest.mark.parametrize(("host", "port"), [("", 0), ("1.2.3.4", 0), ("a b", 80), ("127.0.0.1", None)])
def test_an_address_where_nobody_can_listen_is_refused_in_one_line(host, port):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(RigError, match="nobody can listen at") as refused:
            check_address(host, taken.getsockname()[1] if port is None else port)
    assert len(str(refused.value).splitlines()) == 1
    check_address("127.0.0.1", 0)
