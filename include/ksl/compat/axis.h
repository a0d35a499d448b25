/* KSL: ksl/axis.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_AXIS_H
#define KSL_COMPAT_AXIS_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/axis.h"
#endif
