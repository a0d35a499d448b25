/* KSL: three-vectors, double and float. */
#ifndef KSL_VEC3_H
#define KSL_VEC3_H

#include "ksl/types.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/vec3.inc"
#include "ksl/detail/vec3_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/vec3.inc"
#include "ksl/detail/vec3_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** vo = vi / k.  3 flops. */
KSL_INLINE void ksl_product_ainvv(const double k, const ksl_vec3_t *vi, ksl_vec3_t *vo) { ksl_vec3_divided(vi, k, vo); }

/** vo = vi / k, single precision, its arguments in the order of the published library, which is not that of the name. */
KSL_INLINE void ksl_product_ainvvf(const ksl_vec3f_t *vi, const float k, ksl_vec3f_t *vo) {
  ksl_vec3f_divided(vi, k, vo);
}

/** The vector (x, y, z) of integers. */
KSL_INLINE ksl_vec3i_t ksl_vec3i(const int x, const int y, const int z) {
  ksl_vec3i_t v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}

/** n zero vectors of integers on the heap, to be freed with free(); NULL if n < 1 or there is no memory. */
KSL_INLINE ksl_vec3i_t *ksl_vec3i_alloc(int n) {
  return n < 1 ? NULL : (ksl_vec3i_t *)calloc((size_t)n, sizeof(ksl_vec3i_t));
}

/** Whether two vectors of integers are equal. */
KSL_INLINE bool ksl_vec3i_isEqual(const ksl_vec3i_t *v1, const ksl_vec3i_t *v2) {
  return v1->x == v2->x && v1->y == v2->y && v1->z == v2->z;
}
KSL_END_C

#endif
