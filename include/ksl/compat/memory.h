/* KSL: ksl/memory.h by its bare name, as the published library has it. */
#include "ksl/memory.h"
