/* KSL: ksl/version.h by its bare name, as the published library has it. */
#include "ksl/version.h"
