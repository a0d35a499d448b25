/* KSL: ksl/trig.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_TRIG_H
#define KSL_COMPAT_TRIG_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/trig.h"
#endif
