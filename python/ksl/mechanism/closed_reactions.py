"""Derivatives of reactions along a closed mechanism, from those of the tree that carries its loops.

The wrenches of joints that close loops are external wrenches on the links of the tree.  With dq, dv, da and dw, how the motion and these
wrenches vary with an independent coordinate while the others follow, reactions vary by

    df = ∂f/∂q dq + ∂f/∂v dv + ∂f/∂a da + ∂f/∂w dw,                                                                (1)

with the derivatives of the tree, whose wrenches are held in the axes of their links.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import ResultError
from ksl.base.finite_results import require_finite
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array, External, ExternalAxes, Order, Part, Point, Side, Undetermined, items_of

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class ReactionsAsked:
    """Which reactions, and how they are expressed."""

    joints: list[str]
    on: Side
    at: Point
    axes: str
    order: Order
    part: Part

    @property
    def is_at_joints(self) -> bool:
        return isinstance(self.at, str) and self.at == "joint" and self.axes == "joint"


def reactions_derivatives(
    m: Calls,
    tree: Calls,
    states: tuple[ArrayLike, ArrayLike, ArrayLike],
    external: External | None,
    axes: ExternalAxes,
    request: ReactionsAsked,
    undetermined: Undetermined,
) -> tuple[Array, Array, Array]:
    """Each (…, joints, 6, freedoms); tree: the mechanism with its loops cut."""
    one_of(undetermined, "undetermined", "refuse", "nan")
    of_loops = [name for name in request.joints if name in m.loop_names]
    if of_loops and not request.is_at_joints:
        raise ValueError(
            f'reactions_derivatives: joint {of_loops[0]} closes a loop; its derivatives are those at the joint, in its axes; ask for it with at="joint" and axes="joint"'
        )
    (q, v, a, *given), _, leading = m._with_external((states[0], "q", m.nq), (states[1], "v", m.nv), (states[2], "a", m.nv), external=external, axes=axes)
    wrenches = [(link, wrench) for (link, _), wrench in zip(items_of(external, axes), given, strict=True)]
    open_components = np.zeros((len(q), len(request.joints), 6), dtype=bool)
    for k, position in enumerate(q):
        open_components[k] = _undetermined(m, position, request, undetermined)
    found = _Variations(m, (q, v, a), wrenches, axes)
    out = np.zeros((3, len(q), len(request.joints), 6, found.freedoms))
    of_tree = [i for i, name in enumerate(request.joints) if name not in m.loop_names]
    if of_tree:
        out[:, :, of_tree] = _of_tree(tree, (q, v, a), wrenches, axes, request, [request.joints[i] for i in of_tree], found)
    for i, name in enumerate(request.joints):
        if name in m.loop_names and request.part in ("total", "constraint"):
            of_loop = np.moveaxis(found.at_joints[:, :, :, m.loop_names.index(name)], (0, 1, 2), (1, 0, 3))  # (3, states, 6, freedoms)
            turned = of_loop if request.order == "lin_ang" else np.roll(of_loop, 3, axis=2)
            out[:, :, i] = turned if request.on == "child" else -turned
    for name, by in zip("qva", out):
        require_finite("reactions_derivatives", f"derivative by {name}", by.reshape(len(q), math.prod(by.shape[1:])))
    out[:, open_components] = np.nan
    by_q, by_v, by_a = (x.reshape(*leading, *x.shape[1:]) for x in out)
    return by_q, by_v, by_a


class _Variations:
    """How motions and wrenches of loops vary, for all states."""

    def __init__(self, m: Calls, states: tuple[Array, Array, Array], wrenches: list[tuple[str, Array]], axes: ExternalAxes) -> None:
        links = [m.link_names.index(link) for link, _ in wrenches]
        motions, on_links, at_joints, now, f = m._core.reaction_variations(*states, links, [wrench for _, wrench in wrenches], axes == "world")
        n, loops = len(states[0]), len(m.loops)
        self.freedoms: int = f
        self.motions: Array = motions.reshape(n, 3, f, 3, m.nv)
        """(states, by, freedoms, what, nv)"""
        self.on_links: Array = on_links.reshape(n, 3, f, 2 * loops, 6)
        self.at_joints: Array = at_joints.reshape(n, 3, f, loops, 6)
        self.wrenches: Array = now.reshape(n, 2 * loops, 6)
        """(states, ends, 6): on the links, now."""
        self.links = [link for loop in m.loops for link in (loop.successor, loop.predecessor)]


def _of_tree(
    tree: Calls,
    states: tuple[Array, Array, Array],
    wrenches: list[tuple[str, Array]],
    axes: ExternalAxes,
    request: ReactionsAsked,
    joints: list[str],
    found: _Variations,
) -> Array:
    """(3, states, joints, 6, freedoms): (1)."""

    def derivatives(external: External, held: ExternalAxes) -> Array:
        return np.array(
            tree.reactions_derivatives(*states, external, request.on, request.at, request.axes, request.order, request.part, joints, external_axes=held)
        )

    given = cast("External", dict(wrenches))
    of_loops: dict[str, Array] = {}
    for k, link in enumerate(found.links):
        of_loops[link] = of_loops.get(link, 0.0) + found.wrenches[:, k]
    if axes == "link":
        both = {link: of_loops.get(link, 0.0) + cast("dict[str, Array]", given).get(link, 0.0) for link in {*of_loops, *(link for link, _ in wrenches)}}
        by = derivatives(cast("External", both), "link")
    else:  # some are held in the world's axes and some in those of links: reactions are linear in them
        by = derivatives(given, "world") + derivatives(cast("External", of_loops), "link") - derivatives({}, "link")
    by_wrench = tree.reactions_external_derivatives(states[0], request.on, request.at, request.axes, request.order, request.part, joints)
    ends = by_wrench[..., [tree.link_names.index(link) for link in found.links], :]
    changed: Array = np.einsum("wnjcv,nbfwv->bnjcf", by, found.motions) + np.einsum("njcex,nbfex->bnjcf", ends, found.on_links)
    return changed


def _undetermined(m: Calls, q: Array, request: ReactionsAsked, undetermined: Undetermined) -> NDArray[np.bool_]:
    """(joints, 6) which components are not determined at q; refuses them unless NaN is wanted."""
    patterns = m.reactions_null_basis(q, request.joints)
    if m.mobility(q).redundant > len(patterns):
        raise ValueError(
            "reactions_derivatives: stiffnesses split reactions of this mechanism, and no derivative of that is available; ask the mechanism without them"
        )
    is_open: NDArray[np.bool_] = np.asarray(np.any(patterns != 0, axis=0))
    if not request.is_at_joints:
        is_open = np.repeat(np.any(is_open, axis=1, keepdims=True), 6, axis=1)
    if undetermined == "refuse" and is_open.any():
        k = int(np.argwhere(is_open)[0, 0])
        which = ", ".join(name for name, x in zip(COMPONENTS, is_open[k], strict=True) if x)
        raise ResultError(
            f"reactions_derivatives: {which} of joint {request.joints[k]} are not determined by rigid bodies; reactions_unique says which are: "
            'ask for joints all of whose components are determined, or with undetermined="nan" for NaN in the others'
        )
    return is_open if request.order == "lin_ang" else np.roll(is_open, 3, axis=1)
