"""The numbers behind ksl.spatial, over arrays with any leading shapes; nothing here checks anything.

Poses D are (…, 4, 3), the layout of the C type: the three columns of R, then t.  Six-vectors (…, 6) are linear first,
inertias (…, 10) are m, h, Ixx Iyy Izz Ixy Iyz Izx about the origin.  Names, equations and results are those of the C
algebra (docs/algebra.md); where `ksl.ufuncs` has a function of that name, it takes the place of the one here.
float32 stays float32, float64 stays float64, a mix is promoted.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]


def _cross(a: Floats, b: Floats) -> Floats:
    out: Floats = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def _dot(a: Floats, b: Floats) -> Floats:
    """The last axis stays, with length 1."""
    out: Floats = np.sum(a * b, axis=-1, keepdims=True)
    return out


def _turned(D: Floats, v: Floats) -> Floats:
    """R v."""
    out: Floats = v[..., 0:1] * D[..., 0, :] + v[..., 1:2] * D[..., 1, :] + v[..., 2:3] * D[..., 2, :]
    return out


def _joined(lin: Floats, ang: Floats) -> Floats:
    return np.concatenate([lin, ang], axis=-1)


def product_Ads(D: Floats, s: Floats) -> Floats:
    """(R v + t × R ω, R ω) (coscrews (3))."""
    w = _turned(D, s[..., 3:])
    return _joined(_turned(D, s[..., :3]) + _cross(D[..., 3, :], w), w)


def product_CoAdc(D: Floats, c: Floats) -> Floats:
    """(R f, R τ + t × R f) (coscrews (6))."""
    f = _turned(D, c[..., :3])
    return _joined(f, _turned(D, c[..., 3:]) + _cross(D[..., 3, :], f))


def product_dd(D1: Floats, D2: Floats) -> Floats:
    """(R1 R2, R1 t2 + t1)."""
    out = _turned(D1[..., None, :, :], D2)
    out[..., 3, :] += D1[..., 3, :]
    return out


def SE3_inverted(D: Floats) -> Floats:
    """(Rᵀ, −Rᵀ t)."""
    out: Floats = np.empty_like(D)
    out[..., :3, :] = np.swapaxes(D[..., :3, :], -1, -2)
    out[..., 3, :] = -_turned(out, D[..., 3, :])
    return out


def dot_cs(c: Floats, s: Floats) -> Floats:
    """f · v + τ · ω (coscrews (2))."""
    return _dot(c, s)[..., 0]


def cross_ss(a: Floats, b: Floats) -> Floats:
    """(ω1 × v2 + v1 × ω2, ω1 × ω2)."""
    return _joined(_cross(a[..., 3:], b[..., :3]) + _cross(a[..., :3], b[..., 3:]), _cross(a[..., 3:], b[..., 3:]))


def cross_sc(s: Floats, c: Floats) -> Floats:
    """(ω × f, ω × τ + v × f) (coscrews (12))."""
    return _joined(_cross(s[..., 3:], c[..., :3]), _cross(s[..., 3:], c[..., 3:]) + _cross(s[..., :3], c[..., :3]))


def product_Ms(M: Floats, s: Floats) -> Floats:
    """(m v + ω × h, I ω + h × v)."""
    v, w, h = s[..., :3], s[..., 3:], M[..., 1:4]
    turned = _turned(tensor(M), w)
    return _joined(M[..., :1] * v + _cross(w, h), turned + _cross(h, v))


def spatial_inertia_transformed(M: Floats, D: Floats) -> Floats:
    """Ad*(D) M Ad⁻¹(D)."""
    t = D[..., 3, :]
    turned = np.swapaxes(_turned(D[..., None, :, :], tensor(M)), -1, -2)  # (R I)ᵀ = I Rᵀ, row by row R e_i
    matrix = _turned(D[..., None, :, :], turned)
    h = _turned(D, M[..., 1:4])
    moved = h + M[..., :1] * t
    matrix = matrix + _dot(t, h + moved)[..., None] * np.eye(3, dtype=t.dtype) - h[..., :, None] * t[..., None, :] - t[..., :, None] * moved[..., None, :]
    return inertia_numbers(np.broadcast_to(M[..., 0], moved.shape[:-1]), moved, matrix)


def SE3_exp(s: Floats) -> Floats:
    """R = 1 + a ω̃ + b ω̃², t = (1 + b ω̃ + c ω̃²) v."""
    v, w = s[..., :3], s[..., 3:]
    x = _dot(w, w)
    small = x < 1e-3
    y = np.where(small, 1, x)
    theta = np.sqrt(y)
    half = np.sin(0.5 * theta) / theta
    a = np.where(small, 1 - x * (1 / 6 - x * (1 / 120 - x / 5040)), np.sin(theta) / theta)
    b = np.where(small, 0.5 - x * (1 / 24 - x * (1 / 720 - x / 40320)), 2 * half * half)
    c = np.where(small, 1 / 6 - x * (1 / 120 - x * (1 / 5040 - x / 362880)), (1 - a) / y)

    out: Floats = np.empty((*s.shape[:-1], 4, 3), s.dtype)
    a, b = a[..., 0], b[..., 0]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        # out[column, row]
        out[..., i, i] = 1 - b * (w[..., j] * w[..., j] + w[..., k] * w[..., k])
        out[..., j, i] = b * w[..., i] * w[..., j] - a * w[..., k]
        out[..., i, j] = b * w[..., i] * w[..., j] + a * w[..., k]
    p = _cross(w, v)
    out[..., 3, :] = v + b[..., None] * p + c * _cross(w, p)
    return out


def SE3_log(D: Floats) -> Floats:
    """The screw of smallest |ω| ≤ π whose exponential is D: by a quaternion of R, v = (1 − ω̃/2 + e ω̃²) t."""
    q = _quaternion_ray(D)
    r, c = np.where(q[..., 3:] < 0, -q[..., :3], q[..., :3]), np.abs(q[..., 3:])
    ss, cc = _dot(r, r), c * c
    small = ss < 1e-4 * cc
    k = np.where(small, ss / np.where(small, cc, 1), 0)
    root = np.sqrt(np.where(small, 1, ss))
    g = np.where(small, 2 / np.where(small, c, 1) * (1 - k * (1 / 3 - k * (0.2 - k / 7))), 2 * np.arctan2(root, c) / root)
    w = g * r
    x = _dot(w, w)
    small = x < 1e-3
    e = np.where(small, 1 / 12 + x * (1 / 720 + x / 30240), (1 - 0.5 * g * c) / np.where(small, 1, x))
    t = D[..., 3, :]
    p = _cross(w, t)
    return _joined(t - 0.5 * p + e * _cross(w, p), w).astype(D.dtype, copy=False)


def _quaternion_ray(D: Floats) -> Floats:
    """A quaternion (x, y, z, w) of R, of some length ≥ 1: of the rows of 4 q qᵀ the one with the largest diagonal."""
    rows: Floats = np.empty((*D.shape[:-2], 4, 4), D.dtype)
    d = [D[..., i, i] for i in range(3)]
    rows[..., 3, 3] = 1 + d[0] + d[1] + d[2]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        rows[..., i, i] = 1 + d[i] - d[j] - d[k]
        rows[..., i, j] = rows[..., j, i] = D[..., i, j] + D[..., j, i]
        rows[..., i, 3] = rows[..., 3, i] = D[..., j, k] - D[..., k, j]
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)[..., None, None]
    return np.take_along_axis(rows, largest, axis=-2)[..., 0, :]


def tensor(M: Floats) -> Floats:
    """The matrix I (…, 3, 3) of ten numbers."""
    xx, yy, zz, xy, yz, zx = range(4, 10)
    return M[..., [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]]


def inertia_numbers(m: Floats, h: Floats, matrix: Floats) -> Floats:
    """Ten numbers of m (…), h (…, 3) and I (…, 3, 3), which is symmetric."""
    six = matrix[..., [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    return np.concatenate([m[..., None], h, six], axis=-1)


def parallel_axis(m: Floats, c: Floats) -> Floats:
    """m (|c|² 1 − c cᵀ) (…, 3, 3)."""
    out: Floats = m[..., None, None] * (_dot(c, c)[..., None] * np.eye(3, dtype=c.dtype) - c[..., :, None] * c[..., None, :])
    return out


NUMPY: dict[str, Callable[..., Floats]] = {
    f.__name__: f
    for f in (product_Ads, product_CoAdc, product_dd, SE3_inverted, dot_cs, cross_ss, cross_sc, product_Ms, spatial_inertia_transformed, SE3_exp, SE3_log)
}
"""What is written here, also where a faster function has its name."""

try:
    _faster: Any = importlib.import_module("ksl.ufuncs")
except ModuleNotFoundError:
    _faster = None
globals().update({name: getattr(_faster, name) for name in NUMPY if hasattr(_faster, name)})
