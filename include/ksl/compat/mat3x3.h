/* KSL: ksl/mat3x3.h by its bare name, as the published library has it. */
#include "ksl/mat3x3.h"
