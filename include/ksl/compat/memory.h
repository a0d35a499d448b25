/* KSL: ksl/memory.h by its bare name, as the published library has it. */
#ifndef KSL_COMPAT_MEMORY_H
#define KSL_COMPAT_MEMORY_H
#ifndef KSL_SHORT_AXIS_NAMES
#define KSL_SHORT_AXIS_NAMES
#endif
#include "ksl/memory.h"
#include <string.h> /* as the C library's own memory.h */
#endif
