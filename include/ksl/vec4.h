/* KSL: four-vectors, double and float. */
#ifndef KSL_VEC4_H
#define KSL_VEC4_H

#include "ksl/types.h"
#include "ksl/vec3.h"

#include <math.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/vec4.inc"
#include "ksl/detail/vec4_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/vec4.inc"
#include "ksl/detail/vec4_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** The vector (x, y, z, w) of integers. */
KSL_INLINE ksl_vec4i_t ksl_vec4i(const int x, const int y, const int z, const int w) {
  ksl_vec4i_t v;
  v.x = x;
  v.y = y;
  v.z = z;
  v.w = w;
  return v;
}

/** n zero vectors of integers on the heap, to be freed with free(); NULL if n < 1 or there is no memory. */
KSL_INLINE ksl_vec4i_t *ksl_vec4i_alloc(int n) {
  return n < 1 ? NULL : (ksl_vec4i_t *)calloc((size_t)n, sizeof(ksl_vec4i_t));
}
KSL_END_C

#endif
