/* KSL: ksl/array.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_ARRAY_H
#define KSL_COMPAT_ARRAY_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/array.h"
#endif
