/* KSL: sequences of axes, for Euler angles. */
#ifndef KSL_AXIS_H
#define KSL_AXIS_H

#include "ksl/types.h"

KSL_BEGIN_C
/** The sequence without its prefix, for those who define KSL_SHORT_AXIS_NAMES. */
#ifdef KSL_SHORT_AXIS_NAMES
#define XYZ KSL_AXIS_XYZ
#define YZX KSL_AXIS_YZX
#define ZXY KSL_AXIS_ZXY
#define XZY KSL_AXIS_XZY
#define YXZ KSL_AXIS_YXZ
#define ZYX KSL_AXIS_ZYX
#define XYX KSL_AXIS_XYX
#define XZX KSL_AXIS_XZX
#define YXY KSL_AXIS_YXY
#define YZY KSL_AXIS_YZY
#define ZXZ KSL_AXIS_ZXZ
#define ZYZ KSL_AXIS_ZYZ
#define INVALID KSL_AXIS_INVALID
#endif

/** The axes of a sequence, 0 for x, 1 for y, 2 for z; (0, 1, 2) for what is no sequence. */
KSL_INLINE ksl_vec3i_t ksl_axis_getVector(ksl_axis_enum_t axis) {
  const int axes[13][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}, {0, 1, 0},
                           {0, 2, 0}, {1, 0, 1}, {1, 2, 1}, {2, 0, 2}, {2, 1, 2}, {0, 1, 2}};
  const int n = (int)axis < 0 || axis > KSL_AXIS_INVALID ? (int)KSL_AXIS_INVALID : (int)axis;
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
