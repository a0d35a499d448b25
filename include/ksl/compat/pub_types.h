/* KSL: ksl/pub_types.h by its bare name, as the published library has it. */
#include "ksl/pub_types.h"
