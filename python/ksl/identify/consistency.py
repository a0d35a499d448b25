"""Inertial parameters that a rigid body can have, and coordinates in which every choice is one of these.

The parameters of a link are ten numbers: m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz, about the link's origin and in its axes.
A body of positive density has them exactly if its pseudo-inertia is positive definite (Wensing, Kim, Slotine, Linear matrix
inequalities for physically consistent inertial parameter identification, RA-L 3, 2018).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.mechanism.given import number, numbers

Array = NDArray[np.float64]

PARAMETERS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""Names of a link's ten parameters; mx is mass × x of the centroid."""

SMALL, UNKNOWN = 0.01, 0.01
"""A small body's length: as a share of the robot's, or of the distance of its centroid from the origin; and in m where nothing says it."""

_IXX, _IXY, _IYY, _IXZ, _IYZ, _IZZ = range(4, 10)


def _basis() -> Array:
    """(10, 4, 4): the pseudo-inertia of each unit parameter."""
    E = np.zeros((10, 4, 4))
    E[0, 3, 3] = 1
    for i in range(3):
        E[1 + i, i, 3] = E[1 + i, 3, i] = 1
    for k, (i, j) in {_IXX: (0, 0), _IYY: (1, 1), _IZZ: (2, 2)}.items():
        E[k, :3, :3] = np.eye(3) / 2  # ∫ x xᵀ dm = ½ tr(I) 1 − I
        E[k, i, j] -= 1
    for k, (i, j) in {_IXY: (0, 1), _IXZ: (0, 2), _IYZ: (1, 2)}.items():
        E[k, i, j] = E[k, j, i] = -1
    return E


BASIS = _basis()


def _checked(x: ArrayLike, what: str, width: int = 10) -> Array:
    x = numbers(x, what)
    if x.ndim == 0 or x.shape[-1] != width or not np.isfinite(x).all():
        raise ValueError(f"{what}: expected finite numbers of shape (…, {width}), found shape {x.shape}")
    return x


def pseudo_inertia(parameters: ArrayLike) -> Array:
    """∫ [x; 1] [x; 1]ᵀ dm (…, 4, 4) of parameters (…, 10): [[½ tr(I) 1 − I, m c], [m cᵀ, m]]."""
    return np.asarray(np.einsum("...k,kij->...ij", _checked(parameters, "parameters"), BASIS))


def from_pseudo_inertia(J: ArrayLike) -> Array:
    """Parameters (…, 10) of a pseudo-inertia (…, 4, 4)."""
    J = numbers(J, "J")
    if J.shape[-2:] != (4, 4):
        raise ValueError(f"J: expected a pseudo-inertia of shape (…, 4, 4), found shape {J.shape}")
    S, h = J[..., :3, :3], J[..., :3, 3]
    I = np.trace(S, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - S
    moments = [I[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.stack([J[..., 3, 3], *(h[..., i] for i in range(3)), *moments], axis=-1)


def is_consistent(parameters: ArrayLike) -> NDArray[np.bool_]:
    """Whether a body of positive density can have these parameters (…, 10): is the pseudo-inertia positive definite?

    Point masses, rods and flat plates are limits of such bodies; theirs is only semidefinite, and the answer is no.
    """
    J = pseudo_inertia(parameters)
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", J), 0))  # unit diagonal: kilograms and metres don't enter the answer
    usable = (scale > 0).all(axis=-1)
    J = J / np.where(usable[..., None, None], scale[..., :, None] * scale[..., None, :], 1.0)
    smallest = np.linalg.eigvalsh(J)[..., 0]
    return np.asarray(usable & (smallest > 8 * np.finfo(float).eps))


def log_cholesky(parameters: ArrayLike) -> Array:
    """Coordinates θ (…, 10) of consistent parameters (…, 10): [α, d1, d2, d3, s12, s23, s13, t1, t2, t3].

    The pseudo-inertia is U Uᵀ, with the upper triangular U = e^α [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3],
    [0, 0, 0, 1]] (Rucker, Wensing, Smooth parameterization of rigid-body inertia, RA-L 7, 2022).
    Raises ValueError for parameters that no body can have.
    """
    J = pseudo_inertia(parameters)
    flipped = J[..., ::-1, ::-1]
    try:
        U = np.linalg.cholesky(flipped)[..., ::-1, ::-1]
    except np.linalg.LinAlgError:
        raise ValueError("parameters: no body of positive density has them; is_consistent says which, and nearest_consistent mends them") from None
    scale = U[..., 3, 3]
    U = U / scale[..., None, None]
    d = [np.log(U[..., i, i]) for i in range(3)]
    off = [U[..., i, j] for i, j in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    return np.stack([np.log(scale), *d, *off], axis=-1)


def _factor(theta: Array) -> Array:
    U = np.zeros((*theta.shape[:-1], 4, 4))
    for i in range(3):
        U[..., i, i] = np.exp(theta[..., 1 + i])
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
        U[..., i, j] = theta[..., 4 + k]
    U[..., 3, 3] = 1
    return np.exp(theta[..., 0])[..., None, None] * U


def from_log_cholesky(theta: ArrayLike) -> Array:
    """Parameters (…, 10) of coordinates θ (…, 10): consistent ones for every θ.  The inverse of :func:`log_cholesky`."""
    U = _factor(_checked(theta, "theta"))
    return from_pseudo_inertia(U @ np.swapaxes(U, -1, -2))


def log_cholesky_jacobian(theta: ArrayLike) -> Array:
    """∂ parameters / ∂ θ (…, 10, 10) of :func:`from_log_cholesky`."""
    theta = _checked(theta, "theta")
    U = _factor(theta)
    scale = np.exp(theta[..., 0])
    dU = np.zeros((*theta.shape, 4, 4))
    dU[..., 0, :, :] = U
    for i in range(3):
        dU[..., 1 + i, i, i] = U[..., i, i]
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
        dU[..., 4 + k, i, j] = scale
    half = dU @ np.swapaxes(U, -1, -2)[..., None, :, :]
    return np.swapaxes(from_pseudo_inertia(half + np.swapaxes(half, -1, -2)), -1, -2)


def consistency_metric(parameters: ArrayLike) -> Array:
    """G (…, 10, 10) at consistent parameters: dφᵀ G dφ = tr((J⁻¹ dJ)²), the squared length of a change of the pseudo-inertia J.

    It depends neither on units nor on the axes chosen (Lee, Wensing, Park, Geometric robot dynamic identification, T-RO 36, 2020).
    """
    try:
        inverse = np.linalg.inv(pseudo_inertia(parameters))
    except np.linalg.LinAlgError:
        raise ValueError("parameters: a pseudo-inertia is singular, and has no metric; nearest_consistent gives a body of positive density") from None
    A = inverse[..., None, :, :] @ BASIS
    return np.asarray(np.einsum("...aij,...bji->...ab", A, A))


def barrier(parameters: ArrayLike) -> float:
    """−Σ ln det J over all parameters (…, 10), which grows beyond bounds where bodies cease to be possible.  Its second derivative is
    :func:`consistency_metric`."""
    return -float(np.sum(np.linalg.slogdet(pseudo_inertia(parameters))[1]))


def barrier_gradient(parameters: ArrayLike) -> Array:
    """∂ barrier / ∂ parameters (…, 10)."""
    return np.asarray(-np.einsum("...ij,kji->...k", np.linalg.inv(pseudo_inertia(parameters)), BASIS))


def nearest_consistent(parameters: ArrayLike, least: float = 1e-6, length: float | None = None) -> Array:
    """Parameters (…, 10) that a body can have, near given ones with positive mass: the mass and the centroid stay.

    The second moments ∫ x xᵀ dm about the centroid get eigenvalues of at least `least` times the largest one, or times mass × length²
    where all are smaller than that.  Consistent parameters whose eigenvalues are above that remain as they are.

    length: of a small body of the robot, m, such as a hundredth of the robot's extent.  By default a hundredth of the centroid's distance
    from the origin; where all is at the origin, nothing says how large the body is, and 1 cm is taken.
    """
    J = pseudo_inertia(parameters)
    m, h = J[..., 3, 3], J[..., :3, 3]
    if not (m > 0).all():
        raise ValueError("parameters: expected positive masses; a link without mass can't be made consistent")
    about_centroid = J[..., :3, :3] - h[..., :, None] * h[..., None, :] / m[..., None, None]
    values, axes = np.linalg.eigh(about_centroid)
    floor = least * np.maximum(values[..., -1:], (m * _small_length(m, h, values[..., -1], length) ** 2)[..., None])
    mended = (axes * np.maximum(values, floor)[..., None, :]) @ np.swapaxes(axes, -1, -2)
    change = np.where((values < floor).any(axis=-1)[..., None, None], mended - about_centroid, 0.0)
    out = J.copy()
    out[..., :3, :3] += change
    return from_pseudo_inertia(out)


def _small_length(m: Array, h: Array, largest: Array, length: float | None) -> Array:
    if length is not None:
        if not 0 < number(length, "length") < np.inf:
            raise ValueError(f"length={length}; expected a positive number, m")
        return np.full(m.shape, float(length))
    by_centroid = SMALL * np.linalg.norm(h, axis=-1) / m
    return np.where((by_centroid > 0) | (largest > 0), by_centroid, UNKNOWN)
