/* KSL: ksl/eulerangles.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_EULERANGLES_H
#define KSL_COMPAT_EULERANGLES_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/eulerangles.h"
#endif
