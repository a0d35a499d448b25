/* KSL: sequences of axes, for Euler angles. */
#ifndef KSL_AXIS_H
#define KSL_AXIS_H

#include "ksl/types.h"
#include "ksl/vec3.h"

KSL_BEGIN_C
/** The axes of a sequence, 0 for x, 1 for y, 2 for z; (0, 1, 2) for what is no sequence. */
KSL_INLINE ksl_vec3i_t ksl_axis_getVector(ksl_axis_enum_t axis) {
  const int axes[13][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}, {0, 1, 0},
                           {0, 2, 0}, {1, 0, 1}, {1, 2, 1}, {2, 0, 2}, {2, 1, 2}, {0, 1, 2}};
  const int n = (unsigned)axis > (unsigned)KSL_AXIS_INVALID ? (int)KSL_AXIS_INVALID : (int)axis;
  ksl_vec3i_t v;
  v.x = axes[n][0];
  v.y = axes[n][1];
  v.z = axes[n][2];
  return v;
}

/** The sequence of three axes, 0 for x, 1 for y, 2 for z; KSL_AXIS_INVALID if an axis follows itself or is no axis. */
KSL_INLINE ksl_axis_enum_t ksl_axis_getEulerAngles(ksl_vec3i_t axes) {
  for (int n = 0; n < (int)KSL_AXIS_INVALID; n++) {
    const ksl_vec3i_t v = ksl_axis_getVector((ksl_axis_enum_t)n);
    if (v.x == axes.x && v.y == axes.y && v.z == axes.z)
      return (ksl_axis_enum_t)n;
  }
  return KSL_AXIS_INVALID;
}
KSL_END_C

#endif
