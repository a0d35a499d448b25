/* KSL: transformations of whole arrays: one call for n items.  Link with libksl.

       void ksl_array_product_CoAdc(size_t n, const double *D, ptrdiff_t D_stride,
                                    const double *c, ptrdiff_t c_stride,
                                    double *out, ptrdiff_t out_stride);

   does for (i = 0; i < n; i++) ksl_product_CoAdc(D + i D_stride, c + i c_stride, out + i out_stride), several items at
   once in the lanes of the processor's vectors, with the best instruction set that the processor has.  In float:
   ksl_array_product_CoAdcf.  KSL_ARRAY_FUNCTIONS below lists all of them: KSL_ARRAY_2 (two inputs), KSL_ARRAY_1 (one).

   - An item is numbers in the layout of its type in ksl/types.h, next to each other, aligned as a number is:
     vec3 3; screw (v, ω) and coscrew (f, τ) 6; mat3x3 9, by columns; inertia and spatial_inertia 10; SE3 12, R by
     columns and then t.
   - Strides are in numbers, from item to item: 6 for packed screws, more for items inside larger records, negative to go
     backwards.  An input's stride 0 is the same item for all: one pose for n wrenches.
   - In place: out may be an input, with the same stride.  Otherwise out must not overlap an input or itself.
   - Nothing outside the items is read or written, nothing is allocated, no state is kept.  n may be 0.
   - Each item gets the bits that the linked function of one item gives, with every instruction set, whatever n, its place
     and its neighbours are.
   - Calls can't fail, but if KSL_ISA names a set that does not run here, or none does, the program ends with a message. */
#ifndef KSL_ARRAYS_H
#define KSL_ARRAYS_H

#include "ksl/types.h"

#include <stddef.h>

/* name in double, name in float, then type and name of each input and the type of out.  What each computes, and its
   cost, is stated at the function of one item: ksl/screw.h, coscrew.h, matrix.h, SE3.h, inertia.h, spatial_inertia.h. */
#define KSL_ARRAY_FUNCTIONS(KSL_ARRAY_1, KSL_ARRAY_2)                                                                  \
  KSL_ARRAY_2(product_Ads, product_Adsf, SE3, D, screw, s, screw)                                                      \
  KSL_ARRAY_2(product_Adsinv, product_Adsinvf, SE3, D, screw, s, screw)                                                \
  KSL_ARRAY_2(product_Adinvs, product_Adinvsf, SE3, D, screw, s, screw)                                                \
  KSL_ARRAY_2(product_Adrs, product_Adrsf, mat3x3, R, screw, s, screw)                                                 \
  KSL_ARRAY_2(product_Adrinvs, product_Adrinvsf, mat3x3, R, screw, s, screw)                                           \
  KSL_ARRAY_2(product_Adts, product_Adtsf, vec3, t, screw, s, screw)                                                   \
  KSL_ARRAY_2(product_Adtinvs, product_Adtinvsf, vec3, t, screw, s, screw)                                             \
  KSL_ARRAY_2(product_CoAdc, product_CoAdcf, SE3, D, coscrew, c, coscrew)                                              \
  KSL_ARRAY_2(product_CoAdcinv, product_CoAdcinvf, SE3, D, coscrew, c, coscrew)                                        \
  KSL_ARRAY_2(product_CoAdinvc, product_CoAdinvcf, SE3, D, coscrew, c, coscrew)                                        \
  KSL_ARRAY_2(product_CoAdrc, product_CoAdrcf, mat3x3, R, coscrew, c, coscrew)                                         \
  KSL_ARRAY_2(product_CoAdrinvc, product_CoAdrinvcf, mat3x3, R, coscrew, c, coscrew)                                   \
  KSL_ARRAY_2(product_CoAdtc, product_CoAdtcf, vec3, t, coscrew, c, coscrew)                                           \
  KSL_ARRAY_2(product_CoAdtinvc, product_CoAdtinvcf, vec3, t, coscrew, c, coscrew)                                     \
  KSL_ARRAY_2(cross_ss, cross_ssf, screw, s1, screw, s2, screw)                                                        \
  KSL_ARRAY_2(cross_sc, cross_scf, screw, s, coscrew, c, coscrew)                                                      \
  KSL_ARRAY_2(dot_cs, dot_csf, coscrew, c, screw, s, real)                                                             \
  KSL_ARRAY_2(product_dd, product_ddf, SE3, D1, SE3, D2, SE3)                                                          \
  KSL_ARRAY_2(product_dinvd, product_dinvdf, SE3, D1, SE3, D2, SE3)                                                    \
  KSL_ARRAY_2(product_ddinv, product_ddinvf, SE3, D1, SE3, D2, SE3)                                                    \
  KSL_ARRAY_2(product_dv, product_dvf, SE3, D, vec3, v, vec3)                                                          \
  KSL_ARRAY_2(product_dinvv, product_dinvvf, SE3, D, vec3, v, vec3)                                                    \
  KSL_ARRAY_2(product_drv, product_drvf, mat3x3, R, vec3, v, vec3)                                                     \
  KSL_ARRAY_2(product_drinvv, product_drinvvf, mat3x3, R, vec3, v, vec3)                                               \
  KSL_ARRAY_2(product_Ms, product_Msf, spatial_inertia, M, screw, s, coscrew)                                          \
  KSL_ARRAY_2(spatial_inertia_transformed, spatial_inertiaf_transformed, spatial_inertia, M, SE3, D, spatial_inertia)  \
  KSL_ARRAY_1(inertia_toSpatialInertia, inertiaf_toSpatialInertia, inertia, M, spatial_inertia)                        \
  KSL_ARRAY_1(spatial_inertia_toInertia, spatial_inertiaf_toInertia, spatial_inertia, M, inertia)                      \
  KSL_ARRAY_1(SE3_inverted, SE3f_inverted, SE3, D, SE3)                                                                \
  KSL_ARRAY_1(SE3_exp, SE3f_exp, screw, s, SE3)                                                                        \
  KSL_ARRAY_1(SE3_log, SE3f_log, SE3, D, screw)

KSL_BEGIN_C

#define KSL_DECLARE_ARRAY_1(name, namef, A, a, O)                                                                      \
  KSL_EXPORT void ksl_array_##name(size_t n, const double *a, ptrdiff_t a##_stride, double *out,                       \
                                   ptrdiff_t out_stride);                                                              \
  KSL_EXPORT void ksl_array_##namef(size_t n, const float *a, ptrdiff_t a##_stride, float *out, ptrdiff_t out_stride);
#define KSL_DECLARE_ARRAY_2(name, namef, A, a, B, b, O)                                                                \
  KSL_EXPORT void ksl_array_##name(size_t n, const double *a, ptrdiff_t a##_stride, const double *b,                   \
                                   ptrdiff_t b##_stride, double *out, ptrdiff_t out_stride);                           \
  KSL_EXPORT void ksl_array_##namef(size_t n, const float *a, ptrdiff_t a##_stride, const float *b,                    \
                                    ptrdiff_t b##_stride, float *out, ptrdiff_t out_stride);

KSL_ARRAY_FUNCTIONS(KSL_DECLARE_ARRAY_1, KSL_DECLARE_ARRAY_2)

#undef KSL_DECLARE_ARRAY_1
#undef KSL_DECLARE_ARRAY_2

KSL_END_C

#endif
