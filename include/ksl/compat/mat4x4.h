/* KSL: ksl/mat4x4.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_MAT4X4_H
#define KSL_COMPAT_MAT4X4_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/mat4x4.h"
#endif
