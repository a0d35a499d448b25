/* KSL: ksl/eulerangles.h by its bare name, as the published library has it. */
#include "ksl/eulerangles.h"
