"""Who may open the page of the viewer, and what the page may do.

The server listens on 127.0.0.1, where every program of this machine reaches it, and every page in a browser on this machine, wherever it comes from:
browsers let any page open a WebSocket to any address, and a name that leads to 127.0.0.1 makes a page of another site one of "the same origin"
(DNS rebinding).  So a request must know the token in the page's address, must ask for this host by its number or as localhost, and a WebSocket must be opened
by the page itself, which its browser says in `Origin`.
"""

from __future__ import annotations

import contextlib
import http
import secrets
import socket
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from ksl.base.printable import sentence

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

HOST = "127.0.0.1"
ERRORS = "page-error"
"""Where the page reports its errors to, below the token."""

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob: data:; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data: blob:; connect-src {connect} data: blob:; base-uri 'none'; form-action 'none'"
)
"""What a page of viser may load: what it brings itself, and nothing from the network."""

REPORTER = """<script>(() => {
  let left = 5;
  const page = location.pathname.endsWith("/") ? location.pathname : location.pathname + "/";
  const report = (text) => left-- > 0 && fetch(page + "ERRORS?" + encodeURIComponent(String(text).slice(0, 600))).catch(() => {});
  addEventListener("error", (event) => report(event.message || event.error));
  addEventListener("unhandledrejection", (event) => report(event.reason));
})();</script>""".replace("ERRORS", ERRORS)
"""Tells the server what went wrong in the page, of which nobody would hear otherwise: a page that stays blank says nothing."""


class Gate:
    """Answers what may not be asked, and leaves the rest to viser."""

    def __init__(self, report: Callable[[str], None]) -> None:
        """report: is told the errors of the page, a sentence each."""
        self.token = secrets.token_urlsafe(16)
        self._report = report

    def around(self, serve: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Any]:
        """viser's answer to a request, behind the gate.  None lets a WebSocket be opened."""

        def answer(connection: Any, request: Request) -> Response | None:
            port = connection.local_address[1]
            if not _is_own(request, port):
                return _response(http.HTTPStatus.FORBIDDEN, f"Only the page of ksl view at http://{HOST}:{port} may ask here.\n")
            path, _, query = request.path.partition("?")
            token, _, rest = path.removeprefix("/").partition("/")
            if not secrets.compare_digest(token.encode("utf-8", "surrogateescape"), self.token.encode()):
                return _response(http.HTTPStatus.NOT_FOUND, "The address of this page has a token in it; ksl view has printed it.\n")
            if rest == ERRORS:
                self._report(sentence(unquote(query)))
                return _response(http.HTTPStatus.NO_CONTENT, "")
            request.path = f"/{rest}"  # as viser knows it
            if "Accept-Encoding" in request.headers:
                del request.headers["Accept-Encoding"]  # so that the reporter can be put into the page
            return _of_page(serve(connection, request) if serve else None, port)

        return answer


def _is_own(request: Request, port: int) -> bool:
    """Whether a request names this server, and comes from its own page if it has an origin or opens a WebSocket."""
    names = {f"{name}:{port}" for name in (HOST, "localhost")} | ({HOST, "localhost"} if port == 80 else set())
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    if len(hosts) != 1 or hosts[0] not in names:
        return False
    return origins == [f"http://{hosts[0]}"] if origins or "Upgrade" in request.headers else True


def _of_page(answer: Response | None, port: int) -> Response | None:
    """viser's answer with the reporter in its page, and with what the page may load."""
    if answer is None:
        return None
    head = b"<head>"
    if answer.body and head in answer.body[:2000]:
        answer.body = bytes(answer.body).replace(head, head + REPORTER.encode(), 1)
        del answer.headers["Content-Length"]
        answer.headers["Content-Length"] = str(len(answer.body))
    for name, value in _headers(port).items():
        answer.headers[name] = value
    return answer


def _headers(port: int) -> dict[str, str]:
    own = " ".join(["'self'", *(f"ws://{name}:{port}" for name in (HOST, "localhost"))])  # of 'self', not every browser takes ws:
    return {
        "Content-Security-Policy": POLICY.format(connect=own),
        "Referrer-Policy": "no-referrer",  # the token is in the address
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


def _response(status: http.HTTPStatus, text: str) -> Response:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = text.encode()
    return Response(status.value, status.phrase, Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))}), body)


_starting = threading.Lock()


@contextlib.contextmanager
def behind(gate: Gate) -> Iterator[None]:
    """Within it, a server that viser opens on 127.0.0.1 is behind the gate.

    viser has no argument for it.  It opens its port by `websockets.asyncio.server.serve`, which is replaced meanwhile.  `is_shut` tells whether it has worked.
    """
    from websockets.asyncio import server

    original = server.serve

    def serve(handler: Any, host: Any = None, port: Any = None, **options: Any) -> Any:
        if host == HOST and getattr(handler, "__module__", "").startswith("viser."):
            options["process_request"] = gate.around(options.get("process_request"))
        return original(handler, host, port, **options)

    with _starting:
        server.serve = serve  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            server.serve = original  # type: ignore[misc]


def is_shut(port: int) -> bool:
    """Whether a page of another site can't open a WebSocket at this port."""
    asked = (
        f"GET / HTTP/1.1\r\nHost: {HOST}:{port}\r\nOrigin: http://another.example\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    )
    try:
        with socket.create_connection((HOST, port), timeout=10) as s:
            s.sendall(asked.encode())
            return s.recv(64).split(b" ")[1:2] == [b"403"]
    except OSError:
        return False
