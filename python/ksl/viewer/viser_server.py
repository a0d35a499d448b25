"""Starting a server of viser on this machine."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import TYPE_CHECKING

from ksl.base.errors import ViewerError

if TYPE_CHECKING:
    import viser

PORT = 8080
"""Where the page is unless a port is asked for; if it is in use, at a free one."""


def start_server(port: int | None, name: str) -> viser.ViserServer:
    """A server on 127.0.0.1, which other machines can't reach.

    port: None takes 8080, or if that is in use a free one.  Raises ViewerError where the port is in use, or the extra ksl[view] is missing.
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
    with contextlib.redirect_stdout(io.StringIO()):  # viser announces itself in a box
        return viser.ViserServer(host="127.0.0.1", port=chosen, label=name, verbose=False)


def stop_server(server: viser.ViserServer) -> None:
    """Stops a server without its words on standard output."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _is_free(port: int) -> bool:
    with socket.socket() as s:
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
