/* KSL: ksl/vec3.h by its bare name, as the published library has it. */
#include "ksl/vec3.h"
