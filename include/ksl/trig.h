/* KSL: sine and cosine, angles modulo a turn, double and float. */
#ifndef KSL_TRIG_H
#define KSL_TRIG_H

#include "ksl/config.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/trig.inc"
#include "ksl/detail/trig_scalar.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/trig.inc"
#include "ksl/detail/trig_scalar.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** ksl_catan2pi, by its published name. */
KSL_INLINE double catan2pi(double y, double x, double reference) { return ksl_catan2pi(y, x, reference); }

/** ksl_catan2pif, by its published name. */
KSL_INLINE float catan2pif(float y, float x, float reference) { return ksl_catan2pif(y, x, reference); }

/** ksl_catan1pi, by its published name. */
KSL_INLINE double catan1pi(double y, double x, double reference) { return ksl_catan1pi(y, x, reference); }

/** ksl_catan1pif, by its published name. */
KSL_INLINE float catan1pif(float y, float x, float reference) { return ksl_catan1pif(y, x, reference); }
KSL_END_C

#endif
