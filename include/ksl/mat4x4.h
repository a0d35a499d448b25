/* KSL: 4×4 matrices, double and float. */
#ifndef KSL_MAT4X4_H
#define KSL_MAT4X4_H

#include "ksl/types.h"
#include "ksl/vec3.h"

#include <assert.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/mat4x4.inc"
#include "ksl/detail/mat4x4_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/mat4x4.inc"
#include "ksl/detail/mat4x4_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** The pose whose matrix is Mi, single precision: ksl_mat4x4f_toSE3. */
KSL_INLINE void ksl_mat4x4f_toSE3f(const ksl_mat4x4f_t *Mi, ksl_SE3f_t *Do) { ksl_mat4x4f_toSE3(Mi, Do); }

/** [R t; 0 1] of a pose, single precision: ksl_mat4x4f_fromSE3. */
KSL_INLINE ksl_mat4x4f_t ksl_mat4x4f_fromSE3f(const ksl_SE3f_t D) { return ksl_mat4x4f_fromSE3(D); }
KSL_END_C

#endif
