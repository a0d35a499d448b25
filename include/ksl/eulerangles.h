/* KSL: three Euler angles together with the sequence they belong to. */
#ifndef KSL_EULERANGLES_H
#define KSL_EULERANGLES_H

#include "ksl/axis.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

/** Angles in radians, in the order of the sequence: R = R_i(angles.x) R_j(angles.y) R_k(angles.z). */
typedef struct ksl_eulerangles_t {
  ksl_vec3_t angles;
  ksl_axis_enum_t axis;
} ksl_eulerangles_t;

/** Such angles in single precision. */
typedef struct ksl_euleranglesf_t {
  ksl_vec3f_t angles;
  ksl_axis_enum_t axis;
} ksl_euleranglesf_t;

#endif
