/* KSL: dense 6×6 matrices, double and float. */
#ifndef KSL_MATRIX6_H
#define KSL_MATRIX6_H

#include "ksl/articulated_inertia.h"
#include "ksl/coscrew.h"
#include "ksl/mat3x3.h"
#include "ksl/screw.h"
#include "ksl/spatial_inertia.h"
#include "ksl/types.h"

#include <stddef.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/matrix6.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/matrix6.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
