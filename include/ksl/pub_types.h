/* KSL: the types, by the name that the published library's header of them has. */
#ifndef KSL_PUB_TYPES_H
#define KSL_PUB_TYPES_H

#include "ksl/types.h"

#endif
