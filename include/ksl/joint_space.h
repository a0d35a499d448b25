/* KSL: motion and constraint bases of joints, double and float. */
#ifndef KSL_JOINT_SPACE_H
#define KSL_JOINT_SPACE_H

#include "ksl/coscrew.h"
#include "ksl/screw.h"
#include "ksl/trig.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/joint_space.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/joint_space.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"
KSL_END_C

#endif
