"""Least squares of recorded efforts with a prior, of which only triangular factors for each joint are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ksl.identify.base_parameters import triangle
from ksl.identify.chance import rare
from ksl.identify.consistency import SMALL, UNKNOWN, Array, from_pseudo_inertia, is_consistent, pseudo_inertia
from ksl.identify.possible_bodies import SYMMETRIC, LeastSquares, Minimum, block_diagonal, minimum
from ksl.mechanism.lengths import extent
from ksl.model.model import Model

SAMPLES_AT_A_TIME = 4096

FREEDOM = 0.1
"""Share of the samples that parameters must leave over.  With less, residuals say nothing of the noise."""

RANK = 1e-10
"""What counts as zero of singular values, as a share of the largest one, with columns of unit length."""

EXACT = 1e-9
"""The least noise, as a share of a joint's efforts: efforts that are as exact as doubles are given this one."""

WIDE = 100.0
"""The deviation of a prior that holds nothing."""

ROUNDS = 20
"""How often, at most, noise is estimated from residuals and parameters from the noise.  2 to 6 times are usual."""

SETTLED = 0.01
"""Change of the noise, as a share, at which that ends."""


class Fit:
    """Steps x from the prior, in which the prior is a sphere of radius one: minimise |B x − r|² + |x|².

    A pseudo-inertia is J = C (S0 + d X) Cᵀ, with C Cᵀ that of a round body of the prior's mass, centroid and size, d the prior's deviation,
    and X the symmetric matrix of ten numbers x.  S is 1 for the round body: neither units nor the size of a link enter.
    """

    def __init__(self, model: Model, names: tuple[str, ...], prior: Array, deviation: float, motion: tuple[Array, Array, Array], tau: Array,
                 wrenches: Mapping[str, Array]) -> None:  # fmt: skip
        self.prior, self.deviation, self.n, self.nv = prior, deviation, len(tau), model.nv
        self._take_samples(model, names, motion, tau, wrenches)
        C, inverse = _round_bodies(prior, small_length(model))
        self._S0 = inverse @ pseudo_inertia(prior) @ np.swapaxes(inverse, -1, -2)
        ten = from_pseudo_inertia(C[:, None] @ SYMMETRIC @ np.swapaxes(C, -1, -2)[:, None])
        self.from_steps = deviation * block_diagonal(np.swapaxes(ten, -1, -2))
        """Changes of the parameters for a step x: their covariance by the prior is this times its transpose."""

    def _take_samples(self, model: Model, names: tuple[str, ...], motion: tuple[Array, Array, Array], tau: Array, wrenches: Mapping[str, Array]) -> None:
        size = self.prior.size
        own = model.parameters[[model.link_names.index(name) for name in names]].ravel()
        self._factors = [np.zeros((0, size + 1)) for _ in range(model.nv)]
        self._blocks: list[tuple[Array, Array]] = []
        self.beside_prior = np.zeros((3, model.nv))
        """Sums of products over all samples (3, nv): of all efforts by the prior, E, and those that were given, τ: E E, E τ, τ τ."""
        for first in range(0, self.n, SAMPLES_AT_A_TIME):
            part = slice(first, first + SAMPLES_AT_A_TIME)
            q, v, a = (x[part] for x in motion)
            Y: Array = np.asarray(model.inverse_dynamics_regressor(q, v, a, links=names), dtype=float).reshape(-1, model.nv, size)
            # efforts of what is not identified: all, less those of the links as the model has them
            rest = model.inverse_dynamics(q, v, a, {link: f[part] for link, f in wrenches.items()}) - Y @ own
            self._blocks.append((Y, tau[part] - rest))
            by_prior = Y @ self.prior.ravel() + rest
            with np.errstate(over="ignore"):
                self.beside_prior += [np.sum(x * y, axis=0) for x, y in ((by_prior, by_prior), (by_prior, tau[part]), (tau[part], tau[part]))]
            for j in range(model.nv):
                rows = np.column_stack([Y[:, j], tau[part, j] - rest[:, j]])
                self._factors[j] = triangle(np.vstack([self._factors[j], rows]))

    @property
    def stacked(self) -> Array:
        """A matrix (…, links, 10) with the same null space and inner products as the regressor of all samples."""
        return np.vstack([F[:, :-1] for F in self._factors]).reshape(-1, *self.prior.shape)

    def residuals(self, parameters: Array) -> Array:
        """(n, nv): efforts less those of the parameters."""
        return np.concatenate([efforts - Y @ parameters.ravel() for Y, efforts in self._blocks])

    def size_of_efforts(self) -> Array:
        """Root mean square (nv) of what the links have to explain."""
        return np.asarray(np.sqrt(np.mean(np.concatenate([y for _, y in self._blocks]) ** 2, axis=0)))

    def least_noise(self) -> Array:
        """(nv): what counts as exact.  Joints with hardly any effort are held against the largest one, and against what the prior would need."""
        size = self.size_of_efforts()
        by_prior = np.array([np.linalg.norm(F[:, :-1] @ self.prior.ravel()) for F in self._factors]) / np.sqrt(self.n)
        others = max(size.max(initial=0.0), by_prior.max(initial=0.0), 1e-140)
        return np.asarray(EXACT * np.maximum(size, 1e-3 * others))

    def noise_of_joints(self) -> tuple[Array, Array]:
        """(nv): what least squares of each joint by itself leaves, which neither the prior nor other joints change, and its degrees of freedom.
        NaN where parameters leave too few."""
        out, freedom = np.full(self.nv, np.nan), np.zeros(self.nv)
        for j, F in enumerate(self._factors):
            length = np.linalg.norm(F[:, :-1], axis=0)
            A = F[:, :-1][:, length > 0] / length[length > 0]
            x, _, rank, _ = np.linalg.lstsq(A, F[:, -1], rcond=RANK)
            freedom[j] = self.n - rank
            if freedom[j] > FREEDOM * self.n:
                out[j] = np.linalg.norm(F[:, -1] - A @ x) / np.sqrt(freedom[j])
        return np.where(np.isnan(out), np.nan, np.maximum(out, self.least_noise())), freedom

    def weigh(self, sigma: Array) -> None:
        """Sets the problem for this noise (nv) of the efforts."""
        self.sigma = sigma
        self.weighted = triangle(np.vstack([F / s for F, s in zip(self._factors, sigma)]))
        """The triangular factor of all weighted samples: columns of the parameters, and one of the efforts."""
        self.problem = LeastSquares(self.weighted[:, :-1] @ self.from_steps, self.weighted[:, -1] - self.weighted[:, :-1] @ self.prior.ravel())

    def parameters(self, x: Array) -> Array:
        return np.asarray(self.prior + (self.from_steps @ x).reshape(self.prior.shape))

    def solve(self) -> Minimum:
        """The least sum of squares among parameters of bodies."""
        return minimum(self.problem, self._S0, self.deviation, self._is_possible)

    def _is_possible(self, x: Array) -> bool:
        return bool(is_consistent(self.parameters(x)).all())

    def root_of_covariance(self) -> Array:
        """A square root of the parameters' covariance, of motion and prior together: times its transpose it is that."""
        return np.asarray(np.linalg.solve(self.problem.R.T, self.from_steps.T).T)

    def freedom(self, root: Array) -> Array:
        """Degrees of freedom (nv) that the parameters leave to the residuals of each joint."""
        return np.array([self.n - np.sum((F[:, :-1] @ root / s) ** 2) for F, s in zip(self._factors, self.sigma)])

    def _noise_left(self, parameters: Array, root: Array) -> Array:
        """Standard deviation (nv) of each joint's residuals; what it was where too few samples are left over."""
        freedom = self.freedom(root)
        enough = freedom > FREEDOM * self.n
        squares = np.array([np.sum((F[:, -1] - F[:, :-1] @ parameters) ** 2) for F in self._factors])
        found = np.sqrt(squares / np.where(enough, freedom, 1.0))
        return np.asarray(np.maximum(np.where(enough, found, self.sigma), self.least_noise()))

    def estimate_noise(self) -> tuple[int, float]:
        """Weighs with what least squares of all joints leaves, without prior and with bodies that can't exist: neither changes the noise.
        Returns how many rounds, and by which share the noise last changed."""
        alone = self.noise_of_joints()[0]
        sigma = np.where(np.isnan(alone), np.maximum(0.1 * self.size_of_efforts(), self.least_noise()), alone)
        return self._settle(sigma, self._noise_without_prior)

    def _settle(self, sigma: Array, after: Callable[[], Array]) -> tuple[int, float]:
        done, change = 0, np.inf
        while done < ROUNDS and change > SETTLED:
            self.weigh(sigma)
            left = after()
            change = float(np.abs(left / sigma - 1).max(initial=0.0))
            sigma, done = left, done + 1
        return done, change

    def _noise_without_prior(self) -> Array:
        length = np.linalg.norm(self.weighted[:, :-1], axis=0)
        usable = length > 0
        U, size, Vt = np.linalg.svd(self.weighted[:, :-1][:, usable] / length[usable], full_matrices=False)
        kept = size > RANK * size.max(initial=0.0)
        root = np.zeros((len(length), int(kept.sum())))
        root[usable] = Vt[kept].T / size[kept] / length[usable, None]
        return self._noise_left(root @ (U[:, kept].T @ self.weighted[:, -1]), root)

    def solve_with_noise(self) -> tuple[Minimum, int, float]:
        """Parameters, with noise that is what possible bodies leave: for efforts that none explain.

        Noise and bodies are found by turns, and with a prior that holds nothing: what a wrong one makes of residuals would be taken for noise, and the prior win.
        """

        def after() -> Array:
            problem, found, wider = self._without_prior()
            return self._noise_left(self.parameters(wider * found.x).ravel(), wider * np.linalg.solve(problem.R.T, self.from_steps.T).T)

        done, change = self._settle(self.sigma, after)
        return self.solve(), done, change

    def _without_prior(self) -> tuple[LeastSquares, Minimum, float]:
        """The problem with a prior that holds nothing, its minimum among bodies, and how many times as long its steps are."""
        wider = max(WIDE / self.deviation, 1.0)
        problem = LeastSquares(wider * self.problem.B, self.problem.r)
        return problem, minimum(problem, self._S0, wider * self.deviation, lambda x: self._is_possible(wider * x)), wider

    def excess(self, found: Minimum) -> float:
        """By how much the squares of residuals over noise sum to more than with bodies that can't exist.

        Where that is much, a prior that contradicts the motion may be the reason, and not the constraint: then it is that without prior.
        """
        with_prior = _excess(self.problem, found.x)
        if with_prior <= rare(len(self.problem.r)):
            return with_prior
        problem, alone, _ = self._without_prior()
        return min(with_prior, _excess(problem, alone.x))


def _excess(problem: LeastSquares, x: Array) -> float:
    squares = [float(np.sum((problem.r - problem.B @ each) ** 2)) for each in (x, problem.least)]
    return max(0.0, squares[0] - squares[1])


def small_length(model: Model) -> float:
    """The length of a small link of the robot, m: links that are said to be smaller, or to be points, are taken to be as large as that."""
    return SMALL * extent(model) or UNKNOWN


def _round_bodies(prior: Array, length: float) -> tuple[Array, Array]:
    """C and C⁻¹ (links, 4, 4), with C Cᵀ the pseudo-inertia of a ball of the prior's mass, centroid and size, which is at least the length.

    The prior's deviation is relative to it.  That of a thin body would hold its thickness and the direction of its centroid as if they were known.
    """
    m, c = prior[:, 0], prior[:, 1:4] / prior[:, :1]
    J = pseudo_inertia(prior)
    size = np.trace(J[:, :3, :3], axis1=1, axis2=2) - m * np.sum(c * c, axis=1)  # of the second moments about the centroid
    root = np.sqrt(np.maximum(size, length**2 * m))
    C = np.zeros((len(m), 4, 4))
    C[:, (0, 1, 2), (0, 1, 2)] = root[:, None]
    C[:, 3, 3] = np.sqrt(m)
    C[:, :3, 3] = c * np.sqrt(m)[:, None]
    inverse = np.zeros_like(C)
    inverse[:, (0, 1, 2), (0, 1, 2)] = 1 / root[:, None]
    inverse[:, 3, 3] = 1 / np.sqrt(m)
    inverse[:, :3, 3] = -c / root[:, None]
    return C, inverse
