/* KSL: ksl/SE3.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_SE3_H
#define KSL_COMPAT_SE3_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/SE3.h"
#endif
