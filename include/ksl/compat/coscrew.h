/* KSL: ksl/coscrew.h by its bare name, as the published library has it. */
#include "ksl/coscrew.h"
