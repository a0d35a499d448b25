/* KSL: spatial inertia, double and float. */
#ifndef KSL_SPATIAL_INERTIA_H
#define KSL_SPATIAL_INERTIA_H

#include "ksl/inertia.h"
#include "ksl/matrix.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/spatial_inertia.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/spatial_inertia.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
