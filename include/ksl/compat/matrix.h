/* KSL: ksl/matrix.h by its bare name, as the published library has it. */
#include "ksl/matrix.h"
