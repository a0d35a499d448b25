/* KSL: ksl/axis.h by its bare name, as the published library has it. */
#include "ksl/axis.h"
