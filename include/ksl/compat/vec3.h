/* KSL: ksl/vec3.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_VEC3_H
#define KSL_COMPAT_VEC3_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/vec3.h"
#endif
