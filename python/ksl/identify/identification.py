"""Inertial parameters of links from a recorded motion, such that bodies of positive density have them.

    from ksl.identification import identify
    found = identify(model, q, v, a, tau)
    found.parameters        # (links, 10)
    found.base.names        # the combinations that the motion identifies
    found.base_values       # their values, and found.base_deviations

Joint efforts are a linear function of the parameters (:meth:`ksl.Model.inverse_dynamics_regressor`).  The sum of squared residuals, each
divided by the standard deviation of its joint's noise, is minimised together with the distance from a prior.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import near_names, unknown_name
from ksl.identify.base_parameters import BaseParameters, check_tolerance, moving_links, of_regressor, triangle
from ksl.identify.consistency import (
    Array,
    barrier,
    barrier_gradient,
    consistency_metric,
    from_pseudo_inertia,
    is_consistent,
    nearest_consistent,
    pseudo_inertia,
)
from ksl.model.given import mapping, number, numbers
from ksl.model.model import Model
from ksl.model.states import External, items_of

ACCURACY = 1e-6
"""How far the sum of squares, in units of the noise, may be above its minimum where parameters are at the limit of consistency."""

ROUNDS = 4
"""How often noise is estimated from residuals and the parameters from the noise."""

SAMPLES_AT_A_TIME = 4096


@dataclass(frozen=True)
class Identification:
    """What a motion says about the parameters of some links."""

    links: tuple[str, ...]
    parameters: Array
    """(links, 10): m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz of each link.  A body of positive density has them."""
    covariance: Array
    """(10 · links, 10 · links), of motion and prior together, linearised; what the motion doesn't identify is as uncertain as the prior."""
    base: BaseParameters
    """The combinations that the motion identifies."""
    base_values: Array
    base_covariance: Array
    residuals: Array
    """(n, nv): the efforts that were given, less those of the parameters."""
    noise: Array
    """(nv): standard deviation of each joint's efforts, as given or as estimated from the residuals."""
    free: bool
    """Did least squares by itself give consistent parameters?  If not, the constraint that they be so is at work."""
    model: Model = field(repr=False)
    """The model with these parameters."""

    @property
    def base_deviations(self) -> Array:
        """Standard deviations of the base values."""
        return np.asarray(np.sqrt(np.diag(self.base_covariance)))


def identify(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    tau: ArrayLike,
    links: Iterable[str] | None = None,
    external: External | None = None,
    prior: Mapping[str, ArrayLike] | None = None,
    prior_deviation: float = 1.0,
    noise: ArrayLike | None = None,
    tolerance: float = 1e-4,
) -> Identification:
    """Inertial parameters of links from a motion and the joint efforts that it took.

    q (n, nq), v, a and tau (n, nv): samples.  tau: what :meth:`ksl.Model.inverse_dynamics` of this model gives, N m or N: Sᵀ f, and what
    friction, rotors and so on need only if `physics=` of the model names them.
    external: {link: (6) or (n, 6)}, wrenches as in :meth:`ksl.Model.inverse_dynamics`, in the links' axes.
    links: those to identify; by default all links that move and have mass.  The others keep the parameters of the model.
    prior: {link: ten numbers}, in place of the model's.  Parameters that no body can have are first replaced by near ones that a body can.
    prior_deviation: how far parameters may be from the prior, as a standard deviation relative to the size of the body: 1 means that
    its mass may as well be twice as large, and its centroid anywhere within it.  The prior decides what the motion doesn't identify,
    and hardly anything else.
    noise: standard deviation of each joint's efforts (nv); by default estimated from the residuals.
    tolerance: of what counts as identified; see :func:`ksl.identify.base_parameters.of_motion`.

    Least squares with the prior is solved first.  If a link's parameters are not those of a body, the least sum of squares among those
    of bodies is found, a convex problem (Wensing, Kim, Slotine, RA-L 3, 2018), by an interior point method.  O(n · nv · (10 links)²).
    Raises ValueError for arrays that don't fit, numbers that aren't finite, links without mass, and links that are named twice.
    """
    if not isinstance(model, Model):
        raise ValueError(f"model is {type(model).__name__}; expected a ksl.Model")
    q, v, a, tau = (numbers(model.in_order(x, what), what) for x, what in ((q, "q"), (v, "v"), (a, "a"), (tau, "tau")))
    _check_motion(model, q, v, a, tau)
    check_tolerance(tolerance)
    if links is not None and not isinstance(links, Iterable):
        raise ValueError(f"links={links!r}; expected names of links")
    names = tuple(_links_with_mass(model) if links is None else [links] if isinstance(links, str) else links)
    problem = _Problem(model, names, _prior(model, names, {} if prior is None else prior), prior_deviation, q, v, a, tau, _wrenches(external, len(tau)))
    sigma = _given_noise(noise, model.nv) if noise is not None else problem.first_noise()
    for _ in range(1 if noise is not None else ROUNDS):
        problem.weigh(sigma)
        solution, free = problem.solve()
        covariance = problem.covariance()
        if noise is None:
            sigma = problem.noise(solution, covariance, sigma)
    base = of_regressor(problem.stacked, names, tolerance)
    return Identification(
        links=names,
        parameters=solution,
        covariance=covariance,
        base=base,
        base_values=base.values(solution),
        base_covariance=base.matrix @ covariance @ base.matrix.T,
        residuals=problem.residuals(solution),
        noise=sigma,
        free=free,
        model=model.with_parameters(dict(zip(names, solution))),
    )


class _Problem:
    """Weighted least squares with a prior.  Of the samples only triangular factors for each joint are kept."""

    def __init__(self, model: Model, names: tuple[str, ...], prior: Array, deviation: float, q: Array, v: Array, a: Array, tau: Array,
                 wrenches: dict[str, Array]) -> None:  # fmt: skip
        if not 0 < number(deviation, "prior_deviation") < np.inf:
            raise ValueError(f"prior_deviation={deviation}; expected a positive number")
        self.prior, self.n, self.nv = prior, len(tau), model.nv
        size = prior.size
        # efforts of what is not identified: all, less those of the links as the model has them
        where = [model.link_names.index(name) for name in names]
        own = model.parameters[where].ravel()
        self._factors = [np.zeros((0, size + 1)) for _ in range(model.nv)]
        self._blocks: list[tuple[Array, Array]] = []
        for first in range(0, self.n, SAMPLES_AT_A_TIME):
            part = slice(first, first + SAMPLES_AT_A_TIME)
            Y: Array = np.asarray(model.inverse_dynamics_regressor(q[part], v[part], a[part], links=names), dtype=float).reshape(-1, model.nv, size)
            pushed = {link: f[part] for link, f in wrenches.items()}
            rest = model.inverse_dynamics(q[part], v[part], a[part], pushed) - Y @ own
            self._blocks.append((Y, tau[part] - rest))
            for j in range(model.nv):
                rows = np.column_stack([Y[:, j], tau[part, j] - rest[:, j]])
                self._factors[j] = triangle(np.vstack([self._factors[j], rows]))
        lengths = np.linalg.cholesky(consistency_metric(_rounded(prior)))  # G = L Lᵀ
        self._from_steps = deviation * _block_diagonal(np.swapaxes(np.linalg.inv(lengths), -1, -2))

    @property
    def stacked(self) -> Array:
        """A matrix (…, links, 10) with the same null space and inner products as the regressor of all samples."""
        return np.vstack([F[:, :-1] for F in self._factors]).reshape(-1, *self.prior.shape)

    def residuals(self, parameters: Array) -> Array:
        return np.concatenate([efforts - Y @ parameters.ravel() for Y, efforts in self._blocks])

    def first_noise(self) -> Array:
        """A tenth of each joint's efforts, until residuals are known."""
        size = np.sqrt(np.mean(np.concatenate([y for _, y in self._blocks]) ** 2, axis=0))
        return np.asarray(np.maximum(0.1 * size, 1e-9 * max(size.max(initial=0.0), 1e-300)))

    def weigh(self, sigma: Array) -> None:
        """The problem in steps x from the prior, in which the prior is the unit sphere: |B x − r|² + |x|²."""
        R = triangle(np.vstack([F / s for F, s in zip(self._factors, sigma)]))
        self._B = R[:, :-1] @ self._from_steps
        self._r = R[:, -1] - R[:, :-1] @ self.prior.ravel()

    def _parameters(self, x: Array) -> Array:
        return np.asarray(self.prior + (self._from_steps @ x).reshape(self.prior.shape))

    def solve(self) -> tuple[Array, bool]:
        """Parameters, and whether least squares alone gave consistent ones."""
        n = self.prior.size
        x = np.linalg.lstsq(np.vstack([self._B, np.eye(n)]), np.concatenate([self._r, np.zeros(n)]), rcond=None)[0]
        phi = self._parameters(x)
        if is_consistent(phi).all():
            return phi, True
        return self._solve_among_consistent(), False

    def _solve_among_consistent(self) -> Array:
        """The least sum of squares among consistent parameters, by an interior point method: −μ ln det of each pseudo-inertia is added,
        whose second derivative is μ times the metric, and μ is reduced.  All iterates are consistent, and the problem is convex
        (Boyd, Vandenberghe, Convex optimization (2004), section 11.3)."""
        x, P = np.zeros(self.prior.size), self._from_steps
        H, g = self._B.T @ self._B + np.eye(len(x)), self._B.T @ self._r
        barriers = 4 * len(self.prior)  # the sum of squares is above its minimum by at most twice this, times μ
        mu = max(1.0, float(self._r @ self._r)) / barriers
        while True:
            for _ in range(50):
                phi = self._parameters(x)
                gradient = H @ x - g + mu * P.T @ barrier_gradient(phi).ravel()
                hessian = H + mu * P.T @ _block_diagonal(consistency_metric(phi)) @ P
                step = _newton_step(hessian, gradient)
                decrement = -float(gradient @ step)
                if not decrement > 1e-9 * mu:
                    break
                x = self._moved(x, step, gradient, H, g, mu)
            if mu * barriers < ACCURACY:
                return self._parameters(x)
            mu *= 0.1

    def _moved(self, x: Array, step: Array, gradient: Array, H: Array, g: Array, mu: float) -> Array:
        """x + a share of the step that stays consistent and lowers the sum."""

        def value(y: Array) -> float:
            phi = self._parameters(y)
            return float(y @ (0.5 * H @ y - g)) + mu * barrier(phi) if is_consistent(phi).all() else np.inf

        before, share = value(x), 1.0
        while share > 1e-12:
            if value(x + share * step) <= before + 1e-4 * share * float(gradient @ step):
                return x + share * step
            share *= 0.5
        return x

    def covariance(self) -> Array:
        R = triangle(np.vstack([self._B, np.eye(self.prior.size)]))
        half = self._from_steps @ np.linalg.inv(R)
        return np.asarray(half @ half.T)

    def noise(self, parameters: Array, covariance: Array, before: Array) -> Array:
        """Standard deviation of each joint's residuals, for as many degrees of freedom as the parameters leave."""
        rest = self.residuals(parameters)
        out = np.empty(self.nv)
        for j, F in enumerate(self._factors):
            weighted = F[:, :-1] / before[j]
            used = np.einsum("rk,kl,rl->", weighted, covariance, weighted)
            freedom = self.n - used
            # where a joint has hardly more samples than parameters, residuals say nothing of its noise
            out[j] = np.sqrt(np.sum(rest[:, j] ** 2) / freedom) if freedom > 0.1 * self.n else before[j]
        return np.maximum(out, self.first_noise() * 1e-8)


def _newton_step(hessian: Array, gradient: Array) -> Array:
    """The Newton step of a Hessian that is positive definite but for rounding.  Close to bodies without extension its numbers span more than the
    digits of a double: they are scaled to a unit diagonal, and directions without any digits left are not stepped along."""
    scale = 1 / np.sqrt(np.diagonal(hessian))
    return np.asarray(-scale * np.linalg.lstsq(scale[:, None] * hessian * scale, scale * gradient, rcond=None)[0])


def _block_diagonal(blocks: Array) -> Array:
    n, k, _ = blocks.shape
    out = np.zeros((n, k, n, k))
    out[np.arange(n), :, np.arange(n), :] = blocks
    return out.reshape(n * k, n * k)


def _check_motion(model: Model, q: Array, v: Array, a: Array, tau: Array) -> None:
    for name, x, width in (("q", q, model.nq), ("v", v, model.nv), ("a", a, model.nv), ("tau", tau, model.nv)):
        if x.ndim != 2 or x.shape[1] != width or len(x) != len(q):
            raise ValueError(f"{name}: expected shape ({len(q) if q.ndim == 2 else 'n'}, {width}), a row for each sample; found {x.shape}")
        if not np.isfinite(x).all():
            row, column = np.argwhere(~np.isfinite(x))[0]
            raise ValueError(f"{name}: sample {row}, number {column} is {x[row, column]}; leave out samples that aren't finite")
    if not len(q):
        raise ValueError("q: no samples; a motion needs at least one")


def _wrenches(external: External | None, n: int) -> dict[str, Array]:
    """External wrenches, each (n, 6)."""
    out = {}
    for link, given in items_of(external):
        f = numbers(given, f"external[{link!r}]")
        if f.shape not in ((6,), (1, 6), (n, 6)):
            raise ValueError(f"external[{link!r}] has shape {f.shape}; expected (6,), or ({n}, 6) with a row for each sample")
        out[link] = np.broadcast_to(f, (n, 6))
    return out


def _links_with_mass(model: Model) -> list[str]:
    moving = set(moving_links(model))
    return [link.name for link in model.links if link.name in moving and link.mass > 0]


def _prior(model: Model, names: tuple[str, ...], given: Mapping[str, ArrayLike]) -> Array:
    if not names:
        raise ValueError(f"{model.name or model.file}: no link to identify: none that moves has mass; name some in `links`, with a prior")
    if len(set(names)) != len(names):
        raise ValueError(f"links: {max(names, key=names.count)!r} is named more than once; name each link once")
    chosen = dict(mapping(given, "prior", "{link: ten numbers}"))
    unknown = [link for link in chosen if link not in names]
    if unknown:
        raise ValueError(f"prior: {unknown[0]!r} is not among the links to identify; {near_names(unknown[0], names)}they are {', '.join(names)}")
    known = {link.name: link.parameters for link in model.links}
    for name in names:
        if name not in known:
            raise ValueError(unknown_name(f"links: {model.name or model.file}", "link", name, known))
    for name, ten in chosen.items():
        phi = numbers(ten, f"prior: link {name}")
        if phi.shape != (10,) or not np.isfinite(phi).all():
            raise ValueError(f"prior: link {name} has {phi.size} numbers, or some that aren't finite; expected ten: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz")
    out = np.array([chosen.get(name, known[name]) for name in names], dtype=float)
    for name, phi in zip(names, out):
        if not phi[0] > 0:
            raise ValueError(f"prior: link {name} has mass {phi[0]} kg; give a positive one in `prior`, or leave the link out of `links`")
    return np.where(is_consistent(out)[:, None], out, nearest_consistent(out))


def _rounded(prior: Array) -> Array:
    """Bodies of the same mass, centroid and size that are round, whose metric the prior uses.  That of a thin body would hold its
    thickness and the direction of its centroid as if they were known."""
    m, h = prior[:, 0], prior[:, 1:4]
    J = pseudo_inertia(prior)
    size = np.trace(J[:, :3, :3], axis1=1, axis2=2) - np.sum(h * h, axis=1) / m  # of the second moments about the centroid
    J[:, :3, :3] = h[:, :, None] * h[:, None, :] / m[:, None, None] + np.maximum(size, 1e-4 * m)[:, None, None] * np.eye(3)
    return from_pseudo_inertia(J)


def _given_noise(noise: ArrayLike, nv: int) -> Array:
    sigma = numbers(noise, "noise")
    if sigma.shape not in ((), (1,), (nv,)) or not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise ValueError(f"noise: expected {nv} positive standard deviations, one for each joint velocity, or one for all; found {noise!r}")
    return np.broadcast_to(sigma, (nv,)).copy()
