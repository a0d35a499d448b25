/* KSL: the version of these headers: KSL_VERSION, a string, and KSL_VERSION_MAJOR, _MINOR, _PATCH, numbers. */
#ifndef KSL_VERSION_H
#define KSL_VERSION_H

#include "ksl/config.h"

#endif
