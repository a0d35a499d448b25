"""Starting a server of viser on this machine."""

from __future__ import annotations

import contextlib
import io
import os
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING

from ksl.base.errors import ViewerError
from ksl.base.printable import one_line
from ksl.viewer.gate import HOST, Gate, behind, is_shut

if TYPE_CHECKING:
    import viser

PORT = 8080
"""Where the page is unless a port is asked for; if it is in use, at a free one."""


def start_server(port: int | None, name: str, report: Callable[[str], None] = lambda said: None) -> tuple[viser.ViserServer, str]:
    """A server on 127.0.0.1, which neither other machines nor pages of others can reach (:mod:`ksl.viewer.gate`), and the address of its page.

    port: None takes 8080, or if that is in use a free one.  report: is told the errors of the page.
    Raises ViewerError where the port is in use, or the extra ksl[view] is missing.
    """
    try:
        import viser
    except ImportError:
        raise ViewerError("the viewer needs the extra ksl[view]: pip install 'ksl[view]'") from None
    if port is not None and not 1 <= port <= 65535:
        raise ViewerError(f"port {port}: expected a number from 1 to 65535")
    if port is not None and not _is_free(port):
        raise ViewerError(f"port {port} is in use; give another one, or none, and a free one is taken")
    chosen = port or (PORT if _is_free(PORT) else _free_port())
    gate = Gate(report)
    with contextlib.redirect_stdout(io.StringIO()), behind(gate):  # viser announces itself in a box
        server = viser.ViserServer(host=HOST, port=chosen, label=one_line(name)[:100], verbose=False)
    if not is_shut(server.get_port()):
        stop_server(server)
        raise ViewerError(f"viser {viser.__version__} answers pages of other sites; install the newest of KSL and of viser: pip install -U 'ksl[view]'")
    return server, f"http://{HOST}:{server.get_port()}/{gate.token}/"


def stop_server(server: viser.ViserServer) -> None:
    """Stops a server without its words on standard output."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _is_free(port: int) -> bool:
    with socket.socket() as s:
        if os.name != "nt":  # where the option lets two servers have one port
            s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # a server that has just ended is no obstacle
        try:
            s.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])
