/* KSL: ksl/screw.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_SCREW_H
#define KSL_COMPAT_SCREW_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/screw.h"
#endif
