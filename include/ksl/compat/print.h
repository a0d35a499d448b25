/* KSL: ksl/print.h by its bare name, as the published library has it. */
#include "ksl/print.h"
