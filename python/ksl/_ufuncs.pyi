"""Transformations of whole arrays as NumPy's generalised ufuncs; ksl.ufuncs tells what they are."""

import numpy as np

SE3_exp: np.ufunc
SE3_inverted: np.ufunc
SE3_log: np.ufunc
cross_sc: np.ufunc
cross_ss: np.ufunc
dot_cs: np.ufunc
inertia_toSpatialInertia: np.ufunc
product_Adinvs: np.ufunc
product_Adrinvs: np.ufunc
product_Adrs: np.ufunc
product_Ads: np.ufunc
product_Adsinv: np.ufunc
product_Adtinvs: np.ufunc
product_Adts: np.ufunc
product_CoAdc: np.ufunc
product_CoAdcinv: np.ufunc
product_CoAdinvc: np.ufunc
product_CoAdrc: np.ufunc
product_CoAdrinvc: np.ufunc
product_CoAdtc: np.ufunc
product_CoAdtinvc: np.ufunc
product_Ms: np.ufunc
product_dd: np.ufunc
product_ddinv: np.ufunc
product_dinvd: np.ufunc
product_dinvv: np.ufunc
product_drinvv: np.ufunc
product_drv: np.ufunc
product_dv: np.ufunc
spatial_inertia_toInertia: np.ufunc
spatial_inertia_transformed: np.ufunc

def set_threads(n: int, /) -> int: ...
