/* KSL: poses, double and float; exponential, logarithm and their Jacobians. */
#ifndef KSL_SE3_H
#define KSL_SE3_H

#include "ksl/mat3x3.h"
#include "ksl/matrix.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/SE3.inc"
#include "ksl/detail/SE3_scalar.inc"
#include "ksl/detail/exponential.inc"
#include "ksl/detail/jacobian.inc"
#include "ksl/detail/jacobian_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/SE3.inc"
#include "ksl/detail/SE3_scalar.inc"
#include "ksl/detail/exponential.inc"
#include "ksl/detail/jacobian.inc"
#include "ksl/detail/jacobian_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** Mo = [R t; 0 1], single precision: the published name of ksl_SE3f_toMat4x4. */
KSL_INLINE void ksl_SE3f_toMat4x4f(const ksl_SE3f_t *Di, ksl_mat4x4f_t *Mo) { ksl_SE3f_toMat4x4(Di, Mo); }

/** Mo = [R t; 0 1], rounded to single precision. */
KSL_INLINE void ksl_SE3_toMat4x4f(const ksl_SE3_t *Di, ksl_mat4x4f_t *Mo) {
  ksl_mat4x4_t M;
  ksl_SE3_toMat4x4(Di, &M);
  for (int i = 0; i < 16; i++)
    Mo->as_array[i] = (float)M.as_array[i];
}
KSL_END_C

#endif
