/* KSL: quaternions, double and float. */
#ifndef KSL_QUATERNION_H
#define KSL_QUATERNION_H

#include "ksl/mat3x3.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/quaternion.inc"
#include "ksl/detail/quaternion_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/quaternion.inc"
#include "ksl/detail/quaternion_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/* second names: the published headers and the published library did not agree */

/** q1 q2: ksl_product_qq. */
KSL_INLINE void ksl_quaternion_product_qq(const ksl_quaternion_t *q1i, const ksl_quaternion_t *q2i,
                                          ksl_quaternion_t *qo) {
  ksl_product_qq(q1i, q2i, qo);
}

/** q1* q2: ksl_product_qconjq. */
KSL_INLINE void ksl_quaternion_product_qconjq(const ksl_quaternion_t *q1i, const ksl_quaternion_t *q2i,
                                              ksl_quaternion_t *qo) {
  ksl_product_qconjq(q1i, q2i, qo);
}

/** q1 q2*: ksl_product_qqconj. */
KSL_INLINE void ksl_quaternion_product_qqconj(const ksl_quaternion_t *q1i, const ksl_quaternion_t *q2i,
                                              ksl_quaternion_t *qo) {
  ksl_product_qqconj(q1i, q2i, qo);
}

/** q1* q2*: ksl_product_qconjqconj. */
KSL_INLINE void ksl_quaternion_product_qconjqconj(const ksl_quaternion_t *q1i, const ksl_quaternion_t *q2i,
                                                  ksl_quaternion_t *qo) {
  ksl_product_qconjqconj(q1i, q2i, qo);
}

/** q v: ksl_product_qv. */
KSL_INLINE void ksl_quaternion_product_qv(const ksl_quaternion_t *qi, const ksl_vec3_t *vi, ksl_quaternion_t *qo) {
  ksl_product_qv(qi, vi, qo);
}

/** q* v: ksl_product_qconjv. */
KSL_INLINE void ksl_quaternion_product_qconjv(const ksl_quaternion_t *qi, const ksl_vec3_t *vi, ksl_quaternion_t *qo) {
  ksl_product_qconjv(qi, vi, qo);
}

/** v q: ksl_product_vq. */
KSL_INLINE void ksl_quaternion_product_vq(const ksl_vec3_t *vi, const ksl_quaternion_t *qi, ksl_quaternion_t *qo) {
  ksl_product_vq(vi, qi, qo);
}

/** v q*: ksl_product_vqconj. */
KSL_INLINE void ksl_quaternion_product_vqconj(const ksl_vec3_t *vi, const ksl_quaternion_t *qi, ksl_quaternion_t *qo) {
  ksl_product_vqconj(vi, qi, qo);
}

/** q1⁻¹ q2 of a q1 of length 1, which is q1* q2. */
KSL_INLINE void ksl_quaternion_product_uqinverseq(ksl_quaternion_t *q1i, ksl_quaternion_t *q2i, ksl_quaternion_t *qo) {
  ksl_product_qconjq(q1i, q2i, qo);
}

/** R(q), single precision: ksl_quaternionf_toMat3x3. */
KSL_INLINE void ksl_quaternionf_toMat3x3f(ksl_quaternionf_t *q, ksl_mat3x3f_t *Ro) { ksl_quaternionf_toMat3x3(q, Ro); }

/** ksl_quaternion_slerp */
KSL_INLINE void ksl_slerp(const ksl_quaternion_t *q1, const ksl_quaternion_t *q2, double *t, ksl_quaternion_t *qo) {
  ksl_quaternion_slerp(q1, q2, t, qo);
}

/** ksl_quaternionf_slerp */
KSL_INLINE void ksl_slerpf(const ksl_quaternionf_t *q1, const ksl_quaternionf_t *q2, float *t, ksl_quaternionf_t *qo) {
  ksl_quaternionf_slerp(q1, q2, t, qo);
}

/** ksl_quaternionf_squad */
KSL_INLINE void ksl_squadf(const ksl_quaternionf_t q[4], float *t, ksl_quaternionf_t *qo) {
  ksl_quaternionf_squad(q, t, qo);
}

/** ksl_quaternionf_nlerp */
KSL_INLINE void ksl_nlerpf(const ksl_quaternionf_t *q1, const ksl_quaternionf_t *q2, const float *t,
                           ksl_quaternionf_t *qo) {
  ksl_quaternionf_nlerp(q1, q2, t, qo);
}

/** ksl_add_dpiToq, as the published library spells it. */
KSL_INLINE void kls_add_dpiToq(const ksl_vec3_t *dpi, ksl_quaternion_t *q) { ksl_add_dpiToq(dpi, q); }
KSL_END_C

#endif
