/* KSL: ksl/mat4x4.h by its bare name, as the published library has it. */
#include "ksl/mat4x4.h"
