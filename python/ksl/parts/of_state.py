"""The free bodies of one state: :meth:`ksl.Model.free_bodies`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.calls import Calls
from ksl.mechanism.requests import core_of, one_of
from ksl.mechanism.states import External, ExternalAxes, argument_rows, items_of
from ksl.parts.bodies import BodiesOverTime, Welded
from ksl.parts.free_body import FreeBody


def free_bodies(
    model: Calls, q: ArrayLike, v: ArrayLike, a: ArrayLike, external: External | None = None, welded: Welded = "together", external_axes: ExternalAxes = "link"
) -> dict[str, FreeBody]:
    """See :meth:`ksl.Model.free_bodies`."""
    one_of(welded, "welded", "together", "apart")
    rows = []
    for x, name, columns in ((q, "q", model.nq), (v, "v", model.nv), (a, "a", model.nv)):
        row = argument_rows(x, name, columns, core_of(model))
        if row.shape != (columns,):
            raise ValueError(
                f"{name} has shape {row.shape}; free bodies are those of one state, ({columns}): ksl.free_bodies(run, times=…) has those along a motion"
            )
        rows.append(row[None])
    given = {}
    for link, x in items_of(external, external_axes):
        wrench = argument_rows(x, f"external[{link!r}]", 6, core_of(model))
        if wrench.shape != (6,):
            raise ValueError(f"external[{link!r}] has shape {wrench.shape}; expected (6), of one state")
        given[model.link(link).name] = wrench[None]
    if external_axes == "world":
        poses = {link: model.frame_pose(rows[0][0], f"link:{link}")[:3, :3] for link in given}
        given = {link: np.concatenate([w[0, k : k + 3] @ poses[link] for k in (0, 3)])[None] for link, w in given.items()}
    found = BodiesOverTime(model, rows[0], rows[1], rows[2], given, welded)
    return found.free_bodies(0, found.links_of)
