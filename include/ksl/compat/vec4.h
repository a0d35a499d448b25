/* KSL: ksl/vec4.h by its bare name, as the published library has it. */
#include "ksl/vec4.h"
