"""The least sum of squares among bodies that can exist: an interior point method, and a bound of what it leaves.

The problem is to minimise  F(x) = |B x − r|² + |x|²  such that every  S_i(x) = S0_i + d X_i ⪰ 0,  with X_i the symmetric 4 × 4 matrix of
the ten numbers x_i of body i.  It is convex, a quadratic function over a cone of positive semidefinite matrices (Wensing, Kim, Slotine,
RA-L 3, 2018).  With multipliers Z_i ⪰ 0 its Lagrangian is  F − 2 Σ ⟨Z_i, S_i⟩,  and the minimum is where its gradient is zero and
⟨Z_i, S_i⟩ = 0.

The method follows the path Z_i S_i = μ 1, μ → 0, by Newton steps scaled as Nesterov and Todd do (Self-scaled barriers and interior-point
methods for convex programming, 1997), with Mehrotra's predictor and corrector; Vandenberghe, The CVXOPT linear and quadratic cone program
solvers (2010), has the formulas.  Each step is a problem of least squares, so that no matrix of inner products squares the condition.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ksl.identify.consistency import Array

ACCURACY, ROUNDING = 1e-4, 1e-7
"""How far the sum of squares may be above its minimum, absolutely and as a share of it.  Parameters are then within a hundredth of their own
standard deviations of the minimum, unless the sum is so large that rounding decides."""

WANTED = 1e-6
"""Steps are taken until the sum of squares is so close to its minimum, if rounding lets it come there."""

STEPS = 100
"""At most.  10 to 25 are taken."""

PATIENCE = 5
"""So many steps in a row that come no closer end the search."""

_ROOT = np.sqrt(0.5)
_PAIRS = tuple((i, j) for i in range(4) for j in range(i, 4))


def _orthonormal() -> Array:
    """(10, 4, 4): an orthonormal basis of the symmetric 4 × 4 matrices."""
    E = np.zeros((10, 4, 4))
    for k, (i, j) in enumerate(_PAIRS):
        E[k, i, j] = E[k, j, i] = 1.0 if i == j else _ROOT
    return E


SYMMETRIC = _orthonormal()


def matrices(x: Array) -> Array:
    """(…, 4, 4) of ten numbers each (…, 10) in the basis `SYMMETRIC`."""
    return np.asarray(np.einsum("...k,kij->...ij", x, SYMMETRIC))


def numbers_of(X: Array) -> Array:
    """Ten numbers (…, 10) of symmetric matrices (…, 4, 4): what `matrices` takes."""
    return np.asarray(np.einsum("...ij,kij->...k", X, SYMMETRIC))


def block_diagonal(blocks: Array) -> Array:
    """(n k, n k) of blocks (n, k, k)."""
    n, k, _ = blocks.shape
    out = np.zeros((n, k, n, k))
    out[np.arange(n), :, np.arange(n), :] = blocks
    return out.reshape(n * k, n * k)


@dataclass(frozen=True)
class Minimum:
    """Where the sum of squares is least, as far as it was found."""

    x: Array
    sum_of_squares: float
    above: float
    """The sum of squares is at most this much above its minimum, by the multipliers: a bound that holds whatever the method did."""
    gradient: float
    """Length of the Lagrangian's gradient in the metric of the inverse Hessian: how far x is from where it would be zero, in standard deviations."""
    steps: int
    free: bool
    """Is it the minimum of F by itself, with all bodies possible?"""

    @property
    def converged(self) -> bool:
        return self.above <= ACCURACY + ROUNDING * self.sum_of_squares


class LeastSquares:
    """F(x) = |B x − r|² + |x|², with its factorisation."""

    def __init__(self, B: Array, r: Array) -> None:
        self.B, self.r = B, r
        Q, self.R = np.linalg.qr(np.vstack([B, np.eye(B.shape[1])]))
        self._Q = Q
        self.least = np.linalg.solve(self.R, Q.T @ np.concatenate([r, np.zeros(B.shape[1])]))

    def value(self, x: Array) -> float:
        rest = self.rest(x)
        return float(rest @ rest)

    def rest(self, x: Array) -> Array:
        """Residuals of the data, and of the prior."""
        return np.concatenate([self.r - self.B @ x, -x])

    def distance(self, x: Array, z: Array) -> Array:
        """R⁻ᵀ (½ ∇F − z): the gradient of the Lagrangian, in standard deviations."""
        return np.asarray(-self._Q.T @ self.rest(x) - np.linalg.solve(self.R.T, z))


def minimum(problem: LeastSquares, S0: Array, d: float, possible: Callable[[Array], bool]) -> Minimum:
    """The least F among x whose bodies are possible, those of S0 (bodies, 4, 4) + d X.  O(steps · (10 bodies)³).

    possible: says of the ten numbers x of all bodies whether rounded parameters are still those of bodies.
    """
    x = problem.least
    if possible(x):
        g = problem.distance(x, np.zeros_like(x))
        return Minimum(x, problem.value(x), float(g @ g), float(np.sqrt(g @ g)), 0, True)
    S = np.broadcast_to(np.eye(4), S0.shape)
    x = numbers_of(S - S0).ravel() / d
    slope = problem.B.T @ (problem.B @ x - problem.r) + x
    Z = S * max(1.0, float(np.abs(slope).max()) / d)
    best = _judged(problem, x, S, Z, d, 0)
    for step in range(1, STEPS + 1):
        try:
            x, Z = _stepped(problem, x, S, Z, d)
        except np.linalg.LinAlgError:  # rounding has left one of them no longer positive definite
            break
        S = S0 + d * matrices(x.reshape(-1, 10))
        now = _judged(problem, x, S, Z, d, step)
        if now.above < best.above and possible(x):
            best = now
        if best.above <= WANTED or step - best.steps > PATIENCE:
            break
    return best


def _judged(problem: LeastSquares, x: Array, S: Array, Z: Array, d: float, step: int) -> Minimum:
    """For convex F and any Z ⪰ 0:  F(x) − min F ≤ 2 ⟨Z, S⟩ + |R⁻ᵀ (½ ∇F − d Z)|²,  since the Lagrangian is below F and is least where its gradient is zero."""
    g = problem.distance(x, d * numbers_of(Z).ravel())
    return Minimum(x, problem.value(x), 2 * float(np.sum(Z * S)) + float(g @ g), float(np.sqrt(g @ g)), step, False)


def _stepped(problem: LeastSquares, x: Array, S: Array, Z: Array, d: float) -> tuple[Array, Array]:
    """One step: predictor, corrector, and as far as both S and Z stay positive definite."""
    LS, LZ = np.linalg.cholesky(S), np.linalg.cholesky(Z)
    U, size, Vt = np.linalg.svd(np.swapaxes(LZ, -1, -2) @ LS)  # R⁻¹ S R⁻ᵀ = Rᵀ Z R = diag(size)
    inverse = (np.swapaxes(U, -1, -2) @ np.swapaxes(LZ, -1, -2)) / np.sqrt(size)[:, :, None]
    L = np.eye(4) * size[:, None, :]
    n = len(x)
    scaled = numbers_of(inverse[:, None] @ SYMMETRIC @ np.swapaxes(inverse, -1, -2)[:, None])  # (bodies, 10 of x, 10)
    T = d * block_diagonal(np.swapaxes(scaled, -1, -2))
    Q, R = np.linalg.qr(np.vstack([problem.B, np.eye(n), T]))
    rest = problem.rest(x)

    def moves(right: Array) -> tuple[Array, Array, Array]:
        """x, and the scaled S and Z, for  Λ ∘ (dS + dZ) = right."""
        V = 2 * right / (size[:, :, None] + size[:, None, :])
        dx = np.linalg.solve(R, Q.T @ np.concatenate([rest, numbers_of(V + L).ravel()]))
        dS = matrices((T @ dx).reshape(-1, 10))
        return dx, dS, V - dS

    def longest(move: Array) -> float:
        """The share of the move after which an eigenvalue is zero."""
        root = np.sqrt(size)
        least = float(np.linalg.eigvalsh(move / (root[:, :, None] * root[:, None, :])).min())
        return -1 / least if least < 0 else np.inf

    mu = float(np.sum(size**2)) / size.size
    dx, dS, dZ = moves(-L @ L)
    share = min(1.0, longest(dS), longest(dZ))
    both = dS @ dZ
    dx, dS, dZ = moves((1 - share) ** 3 * mu * np.eye(4) - L @ L - (both + np.swapaxes(both, -1, -2)) / 2)
    share = min(1.0, 0.99 * min(longest(dS), longest(dZ)))
    moved = np.swapaxes(inverse, -1, -2) @ (L + share * dZ) @ inverse
    return x + share * dx, (moved + np.swapaxes(moved, -1, -2)) / 2
