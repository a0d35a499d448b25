/* KSL: ksl/SE3.h by its bare name, as the published library has it. */
#include "ksl/SE3.h"
