/* KSL: ksl/trig.h by its bare name, as the published library has it. */
#include "ksl/trig.h"
