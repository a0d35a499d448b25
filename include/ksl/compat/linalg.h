/* KSL: ksl/linalg.h by its bare name, as the published library has it. */
#include "ksl/linalg.h"
