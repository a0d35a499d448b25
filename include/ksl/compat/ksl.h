/* KSL: ksl/ksl.h by its bare name, as the published library has it. */
#include "ksl/ksl.h"
