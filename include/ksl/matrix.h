/* KSL: products with rotations and poses, double and float. */
#ifndef KSL_MATRIX_H
#define KSL_MATRIX_H

#include "ksl/mat3x3.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/matrix.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/matrix.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
