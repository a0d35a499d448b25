"""External wrenches of a load case: constant, in steps, or from a file; on any link or frame, in stated axes, about a stated point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.states import Array

Interpolation = Literal["hold", "linear"]


@dataclass(frozen=True)
class WrenchOverTime:
    """A wrench that the environment exerts on a link, as a function of time."""

    link: str
    time: Array
    """(n), s, increasing."""
    wrench: Array
    """(n, 6): force, then moment."""
    between: Interpolation
    """Between these times the wrench is that of the earlier one ("hold"), or linear.  Before the first and after the last it is theirs."""
    axes: str = "link"
    """link, world, or the name of a frame."""
    point: Sequence[float] = (0.0, 0.0, 0.0)
    """The point at which the force acts and about which the moment is, in the link's frame, m."""

    def at(self, time: Array) -> Array:
        """The wrench (m, 6) at these times, in its own axes, about its own point."""
        if self.between == "hold":
            found: Array = self.wrench[np.maximum(np.searchsorted(self.time, time, side="right") - 1, 0)]
            return found
        return np.column_stack([np.interp(time, self.time, x) for x in self.wrench.T])

    def on_link(self, model: Calls, time: Array, q: Array) -> Array:
        """The wrench (m, 6) at these times and positions q (m, nq), in the link's axes, about its origin, force first."""
        wrench = self.at(time)
        force, moment = wrench[:, :3], wrench[:, 3:]
        if self.axes != "link":
            to_link = np.swapaxes(model.frame_pose(q, f"link:{self.link}")[:, :3, :3], 1, 2)
            rotation = to_link if self.axes == "world" else to_link @ model.frame_pose(q, self.axes)[:, :3, :3]
            force, moment = (np.einsum("nij,nj->ni", rotation, x) for x in (force, moment))
        return np.hstack([force, moment + np.cross(np.asarray(self.point, dtype=float), force)])


def total_on_links(wrenches: Sequence[WrenchOverTime], model: Calls, time: Array, q: Array) -> dict[str, Array]:
    """{link: (m, 6)}, the sums of all wrenches on each link, as :class:`LoadCase` takes them."""
    total: dict[str, Array] = {}
    for one in wrenches:
        found = one.on_link(model, time, q)
        total[one.link] = total[one.link] + found if one.link in total else found
    return total
