"""What :meth:`ksl.Model.show` returns, for type checkers."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol

from numpy.typing import ArrayLike

from ksl.model.states import External


class ShownModel(Protocol):
    """A page that shows a model, until it is closed or the program ends (`ksl.viewer.live.Viewer`)."""

    @property
    def url(self) -> str:
        """Where a browser on this machine finds the page."""

    def update(self, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, external: External | None = None) -> None:
        """Shows another state (nq), at rest unless v and a (nv) are given; external wrenches stay those of the scene unless given."""

    def play(self, speed: float | None = None) -> None:
        """Plays the motion from the state that is shown, or from the start if that is the last; speed 1 is real time."""

    def open(self) -> bool:
        """Opens the page in the browser of this machine; false if there is none."""

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Writes what is shown into one file that opens offline."""

    def wait(self) -> None:
        """Returns when the page is closed, or at Ctrl-C."""

    def close(self) -> None:
        """Stops the server; pages that are open stay without one."""
