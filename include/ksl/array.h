/* KSL: arrays of numbers, double and float; some for int. */
#ifndef KSL_ARRAY_H
#define KSL_ARRAY_H

#include "ksl/config.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

KSL_BEGIN_C
#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/array.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/array.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** Exchange two integers. */
KSL_INLINE void ksl_swapi(int *a, int *b) {
  const int x = *a;
  *a = *b;
  *b = x;
}

/** True if the n pairs are equal. */
KSL_INLINE bool ksl_allclosei(int n, const int *a, const int *b) {
  for (int i = 0; i < n; i++)
    if (a[i] != b[i])
      return false;
  return true;
}
KSL_END_C

#endif
