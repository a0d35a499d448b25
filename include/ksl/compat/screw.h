/* KSL: ksl/screw.h by its bare name, as the published library has it. */
#include "ksl/screw.h"
