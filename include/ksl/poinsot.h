/* KSL: axis, pitch and magnitude of twists and wrenches, double and float. */
#ifndef KSL_POINSOT_H
#define KSL_POINSOT_H

#include "ksl/coscrew.h"
#include "ksl/screw.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/poinsot.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/poinsot.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
