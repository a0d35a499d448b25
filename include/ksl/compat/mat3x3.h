/* KSL: ksl/mat3x3.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_MAT3X3_H
#define KSL_COMPAT_MAT3X3_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/mat3x3.h"
#endif
