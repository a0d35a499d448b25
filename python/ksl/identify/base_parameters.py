"""Base parameters: the combinations of the links' inertial parameters that joint efforts depend on.

Many parameters enter joint efforts in fixed combinations, and some not at all (Gautier, Khalil, Direct calculation of minimum set of
inertial parameters of serial robots, T-RA 6, 1990; Gautier, Numerical calculation of the base inertial parameters of robots, 1991).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.real_arrays import real_array
from ksl.identify.consistency import PARAMETERS, Array
from ksl.mechanism.calls import Calls
from ksl.mechanism.requests import names_in_order, require_once

TOLERANCE = 1e-8
NEAR = 0.3
"""How far from the neutral position states are, rad and m, of a mechanism that closes from none that is anywhere."""
NOT_SINGULAR = 1e-3
"""The smallest singular value of the loops' equations, as a share of their largest term, at a position that is used."""


@dataclass(frozen=True)
class BaseParameters:
    """Independent combinations of the parameters of some links.

    They are values(parameters) = matrix · φ, with φ the parameters of the links one after the other, ten for each.
    """

    links: tuple[str, ...]
    columns: Array
    """Which parameters stand for the combinations: indices into φ, increasing (n)."""
    matrix: Array
    """(n, 10 · links): a combination is the parameter that stands for it, plus multiples of parameters that depend on it."""
    names: tuple[str, ...]
    """The combinations as text: "forearm.Izz + 0.39 forearm.mx + …", without multiples that are small by the tolerance."""
    without_effect: tuple[str, ...]
    """Parameters that don't enter any effort."""

    def __len__(self) -> int:
        return len(self.columns)

    def values(self, parameters: ArrayLike) -> Array:
        """The combinations (…, n) of parameters (…, links, 10)."""
        phi = np.asarray(real_array(parameters, "parameters"), dtype=float)
        if phi.shape[-2:] != (len(self.links), 10):
            raise ValueError(f"parameters: expected shape (…, {len(self.links)}, 10) for {len(self.links)} links, found {phi.shape}")
        return np.asarray(np.einsum("bk,...k->...b", self.matrix, phi.reshape(*phi.shape[:-2], -1)))

    def regressor(self, regressor: ArrayLike) -> Array:
        """Columns (…, n) of a regressor (…, links, 10): times the combinations it gives what the regressor times φ gives."""
        Y = np.asarray(real_array(regressor, "regressor"), dtype=float)
        return Y.reshape(*Y.shape[:-2], -1)[..., self.columns]


def moving_links(model: Calls) -> list[str]:
    """Links that a moving joint carries, and those welded to them."""
    welded: set[str | None] = {None}
    pending = True
    while pending:
        found = {j.child for j in model.joints if j.nv == 0 and j.parent in welded} - welded
        welded |= found
        pending = bool(found)
    return [name for name in model.link_names if name not in welded]


def links_once(model: Calls, links: Iterable[str]) -> list[str]:
    """The links that are asked for.  Raises ValueError where one is named twice: what a motion tells of it would be told of both."""
    given = names_in_order(links, "links") or ()
    names = [model.link(name).name for name in ([given] if isinstance(given, str) else given)]
    require_once(names, "links")
    return names


def _chosen(model: Calls, links: Iterable[str] | None) -> list[str]:
    """The links that are asked for; those that move by default."""
    return moving_links(model) if links is None else links_once(model, links)


def structural(model: Calls, links: Iterable[str] | None = None, tolerance: float = TOLERANCE, seed: int = 0) -> BaseParameters:
    """What efforts can depend on in any motion: from random states, enough of them for all parameters; of a closed mechanism, the efforts of its drives.

    links: by default those that move.  Others are zero columns.  Raises ValueError for a mechanism with loops without a closed position near
    these states.
    """
    names = _chosen(model, links)
    rng = np.random.default_rng(seed)
    n = 2 * 10 * len(names) // max(model.nv, 1) + 10
    q, v, a = rng.uniform(-np.pi, np.pi, (n, model.nq)), rng.normal(size=(n, model.nv)), rng.normal(size=(n, model.nv))
    for j in model.joints:
        if j.quaternion is not None:
            first = j.q_index + j.quaternion
            q[:, first : first + 4] = rng.normal(size=(n, 4))
            q[:, first : first + 4] /= np.linalg.norm(q[:, first : first + 4], axis=1, keepdims=True)
    if model.loops:
        q, v, a = _closed(model, q, v, a)
    return of_regressor(model.inverse_dynamics_regressor(q, v, a, links=names), names, tolerance)


def _closed(model: Calls, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
    """Motions of a mechanism with loops near these, as many, at closed positions that are not nearly singular."""
    closed = _not_singular(model, q)
    if not len(closed):  # as of a platform on legs that is far from where they reach
        around = np.random.default_rng(0).uniform(-NEAR, NEAR, (len(q), model.nv))
        home = np.broadcast_to(model.close(model.neutral()).q, q.shape)
        closed = _not_singular(model, np.asarray(model.integrate(home, around), dtype=float))
    if not len(closed):
        raise ValueError(f"{model.name}: no closed position was found from {len(q)} random ones; give those of a motion to of_motion")
    at = closed[np.resize(np.arange(len(closed)), len(q))]
    inverse = np.linalg.pinv(model.loop_jacobian(at), rcond=NOT_SINGULAR)
    v = v - np.einsum("nij,njk,nk->ni", inverse, model.loop_jacobian(at), v)
    a = a - np.einsum("nij,nj->ni", inverse, model.loop_acceleration(at, v, a))
    return at, v, a


def _not_singular(model: Calls, q: Array) -> Array:
    """Closed positions (k, nq) that are found from these, and are not nearly singular."""
    found = model.close(q)
    well = [k for k in np.flatnonzero(found.converged) if model.mobility(found.q[k]).smallest > NOT_SINGULAR]
    return np.array([found.q[k] for k in well], dtype=float)


def of_motion(model: Calls, q: ArrayLike, v: ArrayLike, a: ArrayLike, links: Iterable[str] | None = None, tolerance: float = 1e-4) -> BaseParameters:
    """What the efforts of a motion depend on: q (n, nq), v and a (n, nv).

    tolerance: the columns of the parameters before are projected out of a parameter's column; it is independent of them if what is left is longer than
    this share of the column.  A motion that excites a combination weakly doesn't identify it at a larger tolerance.
    """
    names = _chosen(model, links)
    return of_regressor(model.inverse_dynamics_regressor(q, v, a, links=names), names, tolerance)


def check_tolerance(tolerance: float) -> None:
    """ValueError if it is no number between 0 and 1."""
    if not (isinstance(tolerance, (int, float, np.number)) and 0 < tolerance < 1):
        raise ValueError(f"tolerance={tolerance!r}; expected a number between 0 and 1")


def of_regressor(regressor: ArrayLike, links: Sequence[str], tolerance: float = TOLERANCE) -> BaseParameters:
    """From a regressor (…, links, 10) of any kind, with all its other axes stacked.

    Parameters are taken in the order of links, so that those of links nearer to the root stand for the combinations.
    """
    Y = np.asarray(real_array(regressor, "regressor"), dtype=float)
    if Y.ndim < 3 or Y.shape[-2:] != (len(links), 10):
        raise ValueError(f"regressor: expected shape (…, {len(links)}, 10) for {len(links)} links, found {Y.shape}")
    if not np.isfinite(Y).all():
        raise ValueError("regressor: expected finite numbers; leave out states whose rows are not")
    check_tolerance(tolerance)
    W = Y.reshape(Y.size // max(10 * len(links), 1), 10 * len(links))
    W = triangle(W) if len(W) > W.shape[1] else W
    length = np.linalg.norm(W, axis=0)
    enters = length > 1e-13 * max(length.max(initial=0.0), 1e-300)
    Q = np.zeros((len(W), 0))
    columns: list[int] = []
    for k in np.flatnonzero(enters):
        rest = W[:, k] / length[k]
        for _ in range(2):  # the second time for what rounding left
            rest = rest - Q @ (Q.T @ rest)
        size = np.linalg.norm(rest)
        if size > tolerance:
            Q = np.column_stack([Q, rest / size])
            columns.append(int(k))
    index = np.array(columns, dtype=int)
    matrix = np.zeros((len(index), W.shape[1]))
    shown = matrix
    if len(index):
        scaled = np.linalg.lstsq(W[:, index] / length[index], W[:, enters], rcond=None)[0]
        matrix[:, enters] = scaled / length[index, None]
        matrix[:, index] = np.eye(len(index))
        share = np.abs(matrix) * length[index, None] / np.maximum(length, 1e-300)  # of what the parameter does by itself
        matrix[share < 1e-10] = 0
        shown = np.where(share < max(10 * tolerance, 1e-8), 0.0, matrix)  # smaller multiples are only due to weak excitation
    labels = [f"{link}.{p}" for link in links for p in PARAMETERS]
    names = tuple(_name(row, labels, int(k)) for row, k in zip(shown, index))
    return BaseParameters(tuple(links), index, matrix, names, tuple(labels[k] for k in np.flatnonzero(~enters)))


def triangle(x: Array) -> Array:
    """R of the factorisation x = Q R: a matrix with the inner products of the columns of x."""
    return np.asarray(np.linalg.qr(x, mode="r"))


def _name(row: Array, labels: Sequence[str], first: int) -> str:
    terms = [labels[first]]
    for k in np.flatnonzero(row).tolist():
        if k != first:
            size = f"{abs(row[k]):.4g}"
            terms.append(f"{'-' if row[k] < 0 else '+'} {'' if size == '1' else size + ' '}{labels[k]}")
    return " ".join(terms)
