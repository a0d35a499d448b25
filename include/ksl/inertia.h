/* KSL: the published inertia, double and float. */
#ifndef KSL_INERTIA_H
#define KSL_INERTIA_H

#include "ksl/mat3x3.h"
#include "ksl/matrix.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/inertia.inc"
#include "ksl/detail/inertia_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/inertia.inc"
#include "ksl/detail/inertia_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
