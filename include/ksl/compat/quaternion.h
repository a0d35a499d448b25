/* KSL: ksl/quaternion.h by its bare name, as the published library has it. */
#include "ksl/quaternion.h"
