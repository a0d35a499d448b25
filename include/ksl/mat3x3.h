/* KSL: 3×3 matrices, double and float. */
#ifndef KSL_MAT3X3_H
#define KSL_MAT3X3_H

#include "ksl/axis.h"
#include "ksl/trig.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/mat3x3.inc"
#include "ksl/detail/rotation.inc"
#include "ksl/detail/euler_scalar.inc"
#include "ksl/detail/mat3x3_scalar.inc"
#include "ksl/detail/pca_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/mat3x3.inc"
#include "ksl/detail/rotation.inc"
#include "ksl/detail/euler_scalar.inc"
#include "ksl/detail/mat3x3_scalar.inc"
#include "ksl/detail/pca_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** ksl_mat3x3_getEulerAnglesNear as it is published: the reference, a ksl_vec3_t * or a null pointer, is the fourth
    argument of a variadic function. */
KSL_INLINE void ksl_mat3x3_getEulerAnglesWithReference(const ksl_mat3x3_t *Ri, const ksl_axis_enum_t axis,
                                                       ksl_vec3_t *angles, ...) {
  va_list arguments;
  va_start(arguments, angles);
  const ksl_vec3_t *reference = va_arg(arguments, ksl_vec3_t *);
  va_end(arguments);
  ksl_mat3x3_getEulerAnglesNear(Ri, axis, angles, reference);
}

/** The same in single precision; the reference is a ksl_vec3f_t *. */
KSL_INLINE void ksl_mat3x3f_getEulerAnglesWithReference(const ksl_mat3x3f_t *Ri, const ksl_axis_enum_t axis,
                                                        ksl_vec3f_t *angles, ...) {
  va_list arguments;
  va_start(arguments, angles);
  const ksl_vec3f_t *reference = va_arg(arguments, ksl_vec3f_t *);
  va_end(arguments);
  ksl_mat3x3f_getEulerAnglesNear(Ri, axis, angles, reference);
}
KSL_END_C

/** ksl_mat3x3_getEulerAngles(R, axis, angles [, reference]): see ksl_mat3x3_getEulerAnglesNear. */
#define ksl_mat3x3_getEulerAngles(R, axis, ...)                                                                        \
  ksl_mat3x3_getEulerAnglesWithReference(R, axis, __VA_ARGS__, (ksl_vec3_t *)0)

/** ksl_mat3x3f_getEulerAngles(R, axis, angles [, reference]) */
#define ksl_mat3x3f_getEulerAngles(R, axis, ...)                                                                       \
  ksl_mat3x3f_getEulerAnglesWithReference(R, axis, __VA_ARGS__, (ksl_vec3f_t *)0)

#endif
