"""Transformations of whole arrays: generalised ufuncs of NumPy, over the array functions of the C library.

    from ksl import ufuncs
    world = ufuncs.product_CoAdc(D, wrench)        # D (…, 4, 3), wrench (…, 6): leading axes broadcast, out= and dtype= work

A million wrenches by a million poses, or by one, is one call.  All take float64 and float32 and compute in that; each has
a docstring with shapes, equation and cost.  SI units, radians; six-vectors are linear first.

Large calls, of 65536 items and more, use all cores; `set_threads(1)` keeps them on the caller's.  Results are the same bits
for any number of threads.

A pose is (4, 3), as the C library has it: the three columns of R, then t; a rotation is (3, 3), its columns: the matrix
that mathematics writes is its transpose.  `poses` and `matrices` convert.  D_ab carries coordinates of frame b to frame a.
In names, `inv` right after an operand inverts it; `Adsinv` is −Ad s.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl._ufuncs import (
    SE3_exp,
    SE3_inverted,
    SE3_log,
    cross_sc,
    cross_ss,
    dot_cs,
    inertia_toSpatialInertia,
    product_Adinvs,
    product_Adrinvs,
    product_Adrs,
    product_Ads,
    product_Adsinv,
    product_Adtinvs,
    product_Adts,
    product_CoAdc,
    product_CoAdcinv,
    product_CoAdinvc,
    product_CoAdrc,
    product_CoAdrinvc,
    product_CoAdtc,
    product_CoAdtinvc,
    product_dd,
    product_ddinv,
    product_dinvd,
    product_dinvv,
    product_drinvv,
    product_drv,
    product_dv,
    product_Ms,
    set_threads,
    spatial_inertia_toInertia,
    spatial_inertia_transformed,
)
from ksl.base.real_arrays import real_array

__all__ = [
    "SE3_exp",
    "SE3_inverted",
    "SE3_log",
    "cross_sc",
    "cross_ss",
    "dot_cs",
    "inertia_toSpatialInertia",
    "matrices",
    "poses",
    "product_Adinvs",
    "product_Adrinvs",
    "product_Adrs",
    "product_Ads",
    "product_Adsinv",
    "product_Adtinvs",
    "product_Adts",
    "product_CoAdc",
    "product_CoAdcinv",
    "product_CoAdinvc",
    "product_CoAdrc",
    "product_CoAdrinvc",
    "product_CoAdtc",
    "product_CoAdtinvc",
    "product_Ms",
    "product_dd",
    "product_ddinv",
    "product_dinvd",
    "product_dinvv",
    "product_drinvv",
    "product_drv",
    "product_dv",
    "set_threads",
    "spatial_inertia_toInertia",
    "spatial_inertia_transformed",
]


def poses(matrix: ArrayLike) -> NDArray[Any]:
    """(…, 4, 3) poses of (…, 4, 4) homogeneous matrices [R t; 0 1], or of (…, 3, 4) ones [R t].  A copy."""
    m = real_array(matrix, "matrix")
    if m.shape[-2:] not in ((4, 4), (3, 4)):
        raise ValueError(f"expected matrices of shape (…, 4, 4) or (…, 3, 4), found {m.shape}")
    return np.ascontiguousarray(np.swapaxes(m[..., :3, :], -1, -2))


def matrices(D: ArrayLike) -> NDArray[Any]:
    """(…, 4, 4) homogeneous matrices [R t; 0 1] of (…, 4, 3) poses."""
    D = real_array(D, "D")
    if D.shape[-2:] != (4, 3):
        raise ValueError(f"expected poses of shape (…, 4, 3), found {D.shape}")
    m = np.zeros((*D.shape[:-2], 4, 4), D.dtype)
    m[..., :3, :] = np.swapaxes(D, -1, -2)
    m[..., 3, 3] = 1
    return m
