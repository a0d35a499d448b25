"""Arithmetic at 200 bits on numpy object arrays, and the operators of the theory as dense matrices, each built from its
definition.  Nothing here is written in components.

Inside `with extended():` the same is done in 64-bit arithmetic (80-bit numbers), whose u is 2048 times smaller than that
of double: enough to see 4 u, and fast enough for 10⁵ cases."""

import contextlib

import gmpy2
import numpy as np

gmpy2.get_context().precision = 200

to_mp = np.frompyfunc(gmpy2.mpfr, 1, 1)
sqrt_mp = np.frompyfunc(gmpy2.sqrt, 1, 1)
ZERO, ONE = gmpy2.mpfr(0), gmpy2.mpfr(1)
HAS_EXTENDED = np.finfo(np.longdouble).nmant >= 63
_extended = False
UNIT = {"double": 2.0**-53, "float": 2.0**-24}  # u, the unit roundoff


@contextlib.contextmanager
def extended():
    global _extended
    _extended = True
    try:
        yield
    finally:
        _extended = False


def mp(x):
    """Numbers as they are, at 200 bits."""
    x = np.asarray(x, dtype=np.float64)
    return x.astype(np.longdouble) if _extended else to_mp(x.astype(object))


def sqrt(x):
    return np.sqrt(x) if _extended else sqrt_mp(x)


def zeros(*shape):
    return np.zeros(shape, np.longdouble) if _extended else np.full(shape, ZERO, dtype=object)


def identity(n, k):
    out = zeros(n, k, k)
    out[:, range(k), range(k)] = ONE
    return out


def mul(A, B):
    """Matrix × matrix or matrix × vector, case by case."""
    if B.ndim == 2:
        return (A * B[:, None, :]).sum(-1)
    return np.stack([(A * B[:, None, :, j]).sum(-1) for j in range(B.shape[2])], axis=-1)


def T(A):
    return A.transpose(0, 2, 1)


def norm(x):
    """Euclidean norm of each row, as a float."""
    return np.sqrt((x.astype(float).reshape(len(x), -1) ** 2).sum(-1))


def distance(numbers, x):
    """|numbers − x| of each row, as a float: numbers of either precision, taken exactly, and a reference at 200 bits."""
    return norm(x - np.asarray(numbers, np.float64).astype(x.dtype))


def spectral(A):
    """Spectral norm of each 3×3 matrix, as a float: by the largest eigenvalue of AᵀA, which is that of a cubic."""
    A = A.astype(float)
    size = np.abs(A).max(axis=(1, 2), initial=0)
    A = A / np.where(size > 0, size, 1)[:, None, None]
    B = A.transpose(0, 2, 1) @ A
    mean = np.trace(B, axis1=1, axis2=2) / 3
    C = B - mean[:, None, None] * np.eye(3)
    p = np.sqrt((C**2).sum((1, 2)) / 6)
    angle = np.arccos(np.clip(np.linalg.det(C / np.where(p > 0, p, 1)[:, None, None]) / 2, -1, 1)) / 3
    return size * np.sqrt(mean + 2 * p * np.cos(angle))


def dot(a, b):
    return (a * b).sum(-1)


def tilde(v):
    """ṽ, with ṽ w = v × w, from the Levi-Civita symbol."""
    out = zeros(len(v), 3, 3)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, i, k] = v[:, j]
        out[:, k, i] = -v[:, j]
    return out


def cross(a, b):
    return mul(tilde(a), b)


def outer(a, b):
    return a[:, :, None] * b[:, None, :]


def block(A, B, C, D):
    return np.concatenate([np.concatenate([A, B], 2), np.concatenate([C, D], 2)], 1)


def matrix(m):
    """A mat3x3 (nine numbers, columns first) as a matrix."""
    return m.reshape(-1, 3, 3).transpose(0, 2, 1)


def numbers(M):
    """A matrix as numbers, columns first."""
    return M.transpose(0, 2, 1).reshape(len(M), -1)


def pose(d):
    """An SE3 (R, t) as its 4×4 matrix."""
    out = identity(len(d), 4)
    out[:, :3, :3] = matrix(d[:, :9])
    out[:, :3, 3] = d[:, 9:]
    return out


def inverse_pose(D):
    """(Rᵀ, −Rᵀ t), R as rounded."""
    out = identity(len(D), 4)
    out[:, :3, :3] = T(D[:, :3, :3])
    out[:, :3, 3] = -mul(T(D[:, :3, :3]), D[:, :3, 3])
    return out


def Ad(D):
    """coscrews (3)"""
    R, t = D[:, :3, :3], D[:, :3, 3]
    return block(R, mul(tilde(t), R), zeros(len(D), 3, 3), R)


def CoAd(D):
    """coscrews (6)"""
    R, t = D[:, :3, :3], D[:, :3, 3]
    return block(R, zeros(len(D), 3, 3), mul(tilde(t), R), R)


def ad(s):
    """The derivative of [Ad] along a twist: ad(s1) s2 is the Lie bracket."""
    v, w = tilde(s[:, :3]), tilde(s[:, 3:])
    return block(w, v, zeros(len(s), 3, 3), w)


def coad(s):
    """[ad]* = −[ad]ᵀ"""
    return -T(ad(s))


def rotation_pose(R):
    out = identity(len(R), 4)
    out[:, :3, :3] = R
    return out


def translation_pose(t):
    out = identity(len(t), 4)
    out[:, :3, 3] = t
    return out


def axis_rotation(k, dc):
    """R_x, R_y or R_z from {sin, cos}: 1 + s ẽ + (1 − c) ẽ²."""
    e = zeros(len(dc), 3)
    e[:, k] = ONE
    E = tilde(e)
    return identity(len(dc), 3) + dc[:, 0, None, None] * E + (1 - dc[:, 1])[:, None, None] * mul(E, E)


def spatial_inertia(m, h, inertia):
    """M = [m1 −h̃; h̃ I]"""
    return block(m[:, None, None] * identity(len(m), 3), -tilde(h), tilde(h), inertia)


def symmetric(six):
    """Ixx, Iyy, Izz, Ixy, Iyz, Izx as a matrix."""
    out = zeros(len(six), 3, 3)
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
        out[:, i, j] = out[:, j, i] = six[:, k]
    return out


def six(S):
    return np.stack([S[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], -1)


def parallel_axis(m, r):
    """m (|r|² 1 − r rᵀ) = −m r̃²"""
    return -m[:, None, None] * mul(tilde(r), tilde(r))


def expm(A):
    """exp of square matrices by the definition, its power series, with scaling and squaring."""
    k = 4 + max(0, int(np.ceil(np.log2(max(1e-300, np.abs(A.astype(float)).sum(-1).max())))))
    A = A / gmpy2.mpfr(2) ** k
    term = out = identity(len(A), A.shape[1])
    for n in range(1, 31):
        term = mul(term, A) / n
        out = out + term
    for _ in range(k):
        out = mul(out, out)
    return out


def twist_matrix(s):
    """[ω̃ v; 0 0], whose exponential is a pose."""
    out = zeros(len(s), 4, 4)
    out[:, :3, :3] = tilde(s[:, 3:])
    out[:, :3, 3] = s[:, :3]
    return out


def solve3(A):
    """A⁻¹ of 3×3 matrices: adjugate over determinant, at 200 bits."""
    x, y, z = A[:, :, 0], A[:, :, 1], A[:, :, 2]
    n = np.stack([cross(y, z), cross(z, x), cross(x, y)], 1)
    return n / dot(x, n[:, 0])[:, None, None]


def rotations(random, n):
    """n random rotations at 200 bits: from unit quaternions q, R = 1 + 2 w r̃ + 2 r̃²."""
    q = mp(random.normal(size=(n, 4)))
    q = q / sqrt(dot(q, q))[:, None]
    r = tilde(q[:, :3])
    return identity(n, 3) + 2 * q[:, 3, None, None] * r + 2 * mul(r, r)


def magnitudes(random, n, scalar):
    """Magnitudes over many decades, such that products of three stay in the normal range."""
    return 10.0 ** (random.uniform(-30, 30, n) if scalar == "double" else random.uniform(-6, 6, n))


def vectors(random, n, scalar):
    v = random.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None] * magnitudes(random, n, scalar)[:, None]


def sample(random, n, t):
    """n random arguments of a type of functions.py, as numbers of that precision."""
    dtype = np.float64 if t.scalar == "double" else np.float32
    if t.base == "axis_enum":
        return random.integers(0, 12, n)
    if t.base == "int":
        return random.integers(0, 3, n)
    if t.base == "real" and t.kind != "value":
        angle = random.uniform(-4, 4, n)
        x = np.stack([np.sin(angle), np.cos(angle)], -1)
    elif t.base == "real":
        x = random.choice([-1, 1], n) * magnitudes(random, n, t.scalar)
    elif t.base == "vec3":
        x = vectors(random, n, t.scalar)
    elif t.base in ("mat4x4", "quaternion", "vec4", "joint_space"):
        x = random.normal(size=(n, t.numbers()))
    elif t.base in ("screw", "coscrew", "motion", "force"):
        x = np.concatenate([vectors(random, n, t.scalar), vectors(random, n, t.scalar)], 1)
    elif t.base == "mat3x3":
        x = numbers(rotations(random, n)).astype(float)
    elif t.base in ("SE3", "plucker"):
        x = np.concatenate([numbers(rotations(random, n)).astype(float), vectors(random, n, t.scalar)], 1)
    elif t.base in ("inertia", "spatial_inertia"):
        # a body of mass m, size a, its centroid at c: diag(I) obeys the triangle inequality
        m, a, c = magnitudes(random, n, t.scalar) ** 0.3, magnitudes(random, n, t.scalar) ** 0.3, vectors(random, n, t.scalar)
        c = c / np.linalg.norm(c, axis=1)[:, None] * magnitudes(random, n, t.scalar)[:, None] ** 0.3
        p = random.uniform(0.1, 1, (n, 3))
        R = rotations(random, n).astype(float)
        J = R @ (np.eye(3) * (p.sum(1)[:, None] - p)[:, None, :]) @ R.transpose(0, 2, 1) * (m * a**2)[:, None, None]
        if t.base == "spatial_inertia":
            J = J + m[:, None, None] * ((c**2).sum(1)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None, :])
        x = np.concatenate([m[:, None], m[:, None] * c, six(J)], 1)
    elif t.base == "articulated_inertia":
        # a symmetric matrix whose blocks have the units of mass, first moment and inertia
        a = magnitudes(random, n, t.scalar)[:, None] ** 0.3
        M, H, J = random.normal(size=(n, 6)), random.normal(size=(n, 9)), random.normal(size=(n, 6))
        x = magnitudes(random, n, t.scalar)[:, None] ** 0.3 * np.concatenate([M, a * H, a**2 * J], 1)
    else:
        raise KeyError(t.base)
    return x.astype(dtype)
