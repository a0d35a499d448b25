/* KSL: angular-first spatial vectors and Plücker transforms, double and float. */
#ifndef KSL_PLUCKER_H
#define KSL_PLUCKER_H

#include "ksl/SE3.h"
#include "ksl/matrix6.h"
#include "ksl/spatial_inertia.h"
#include "ksl/trig.h"
#include "ksl/types.h"

#include <stddef.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/plucker.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/plucker.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
