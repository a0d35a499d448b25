"""Who may open the page of the viewer: its own page, with the token in its address, and nobody else."""

import socket
import urllib.error
import urllib.request

import pytest

pytest.importorskip("viser", reason="the package viser is not installed")


@pytest.fixture(scope="module")
def viewer(arm):
    from ksl.viewer.live import Viewer
    from ksl.viewer.scene import make_scene

    with Viewer(make_scene(arm)) as viewer:
        yield viewer


def status_of_socket(url: str, host: str | None, origin: str | None) -> int:
    """The status with which opening a WebSocket ends; 101 for one that is open."""
    import viser
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    headers = {} if host is None else {"Host": host}
    try:
        with connect(url, origin=origin, additional_headers=headers, subprotocols=[f"viser-v{viser.__version__}"], open_timeout=30) as socket:
            assert socket.recv(timeout=30)
            return 101
    except InvalidStatus as e:
        return int(e.response.status_code)


@pytest.mark.parametrize(
    ("token", "origin", "status"),
    [
        ("own", "own", 101),
        ("own", "http://localhost:PORT", 403),  # not the name by which it was asked for
        ("own", "https://evil.example", 403),
        ("own", "http://127.0.0.1", 403),
        ("own", "http://127.0.0.1:PORT.evil.example", 403),
        ("own", "null", 403),
        ("own", None, 403),
        ("", "own", 404),
        ("guessed", "own", 404),
        ("own/", "own", 101),
    ],
)
def test_only_the_own_page_opens_a_socket(viewer, token, origin, status):
    port = str(viewer.server.get_port())
    own = viewer.url.split("/")[3]
    origin = f"http://127.0.0.1:{port}" if origin == "own" else origin and origin.replace("PORT", port)
    assert status_of_socket(f"ws://127.0.0.1:{port}/{token.replace('own', own)}", None, origin) == status


def asked(url: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=60) as answer:
            return answer.status, answer.read().decode(), dict(answer.headers)
    except urllib.error.HTTPError as e:
        return e.code, e.read().decode(), dict(e.headers)


def test_the_page_is_at_its_address_alone(viewer):
    port = viewer.server.get_port()
    status, page, headers = asked(viewer.url)
    assert status == 200 and "unhandledrejection" in page[:1500]
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "http" not in policy and headers["Referrer-Policy"] == "no-referrer"
    assert asked(f"http://127.0.0.1:{port}/")[:2] == (404, "The address of this page has a token in it; ksl view has printed it.\n")
    assert asked(viewer.url, Host=f"evil.example:{port}")[0] == 403, "a name of another that leads here"
    assert asked(viewer.url, Host="127.0.0.1:1")[0] == 403
    assert asked(viewer.url, Origin="https://evil.example")[0] == 403
    assert asked(viewer.url, Host=f"localhost:{port}")[0] == 200
    assert len(viewer.url.split("/")[3]) >= 20 and viewer.url in repr(viewer)


def test_bytes_that_are_no_text_are_no_token(viewer):
    port = viewer.server.get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=60) as s:
        s.sendall(b"GET /\xff\xc3 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n" % port)
        assert s.recv(64).startswith(b"HTTP/1.1 404 ")


def test_a_viser_that_cannot_be_guarded_is_not_shown(arm, monkeypatch):
    import contextlib

    import ksl.viewer.viser_server as server
    from ksl.base.errors import ViewerError

    monkeypatch.setattr(server, "behind", lambda gate: contextlib.nullcontext())
    with pytest.raises(ViewerError, match="answers pages of other sites"):
        server.start_server(None, "arm")
