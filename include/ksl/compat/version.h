/* KSL: ksl/version.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_VERSION_H
#define KSL_COMPAT_VERSION_H
#include "ksl/version.h"
#endif
