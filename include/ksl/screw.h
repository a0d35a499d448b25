/* KSL: screws, double and float. */
#ifndef KSL_SCREW_H
#define KSL_SCREW_H

#include "ksl/mat3x3.h"
#include "ksl/matrix.h"
#include "ksl/types.h"
#include "ksl/vec3.h"

#include <float.h>
#include <stddef.h>
#include <stdlib.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/screw.inc"
#include "ksl/detail/screw_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/screw.inc"
#include "ksl/detail/screw_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** h = −(t × R x, R x): a published misspelling of ksl_hsrxinvf. */
KSL_INLINE void ksl_hrxinvf(const ksl_SE3f_t *D, ksl_screwf_t *h) { ksl_hsrxinvf(D, h); }
KSL_END_C

#endif
