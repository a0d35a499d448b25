/* KSL: ksl/array.h by its bare name, as the published library has it. */
#include "ksl/array.h"
