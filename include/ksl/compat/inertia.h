/* KSL: ksl/inertia.h by its bare name, as the published library has it. */
#include "ksl/inertia.h"
