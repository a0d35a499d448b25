/* KSL: the types, double and float. */
#ifndef KSL_TYPES_H
#define KSL_TYPES_H

#include "ksl/config.h"

#include <stdbool.h>

/* Anonymous structs are C11; in C++ they are an extension that gcc and clang accept in silence behind this word.  In C99, -pedantic
   is told once that they are meant. */
#if !defined(__cplusplus) && defined(__GNUC__) && __STDC_VERSION__ < 201112L
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#endif
#ifdef __cplusplus
#define KSL_VIEW __extension__ struct
#else
#define KSL_VIEW struct
#endif

#define KSL_NAMES KSL_NAMES_DOUBLE
#include "ksl/detail/names.h"
#include "ksl/detail/types.inc"
#define KSL_NAMES KSL_NAMES_FLOAT
#include "ksl/detail/names.h"
#include "ksl/detail/types.inc"
#define KSL_NAMES KSL_NAMES_END
#include "ksl/detail/names.h"

/** What a joint lets its child do (joint_space.h). */
typedef enum ksl_joint_kind_t {
  KSL_JOINT_FIXED,       /**< nothing */
  KSL_JOINT_REVOLUTE,    /**< turns about an axis */
  KSL_JOINT_PRISMATIC,   /**< slides along an axis */
  KSL_JOINT_HELICAL,     /**< turns about an axis and advances along it by a pitch per radian */
  KSL_JOINT_CYLINDRICAL, /**< slides along an axis and turns about it */
  KSL_JOINT_UNIVERSAL,   /**< turns about an axis, then about one normal to it that the first carries along */
  KSL_JOINT_SPHERICAL,   /**< turns about a point */
  KSL_JOINT_PLANAR,      /**< slides in a plane and turns about its normal */
  KSL_JOINT_FREE         /**< everything */
} ksl_joint_kind_t;

/** Three integers. */
typedef union ksl_vec3i_t {
  KSL_VIEW { int at[3]; };
  KSL_VIEW { int x, y, z; };
} ksl_vec3i_t;

/** Four integers; r is the part (x, y, z). */
typedef union ksl_vec4i_t {
  KSL_VIEW { int at[4]; };
  KSL_VIEW { ksl_vec3i_t r; };
  KSL_VIEW { int x, y, z, w; };
} ksl_vec4i_t;

/** The twelve sequences of axes that Euler angles may turn about. */
typedef enum ksl_axis_enum_t {
  KSL_AXIS_XYZ = 0,
  KSL_AXIS_YZX,
  KSL_AXIS_ZXY,
  KSL_AXIS_XZY,
  KSL_AXIS_YXZ,
  KSL_AXIS_ZYX,
  KSL_AXIS_XYX,
  KSL_AXIS_XZX,
  KSL_AXIS_YXY,
  KSL_AXIS_YZY,
  KSL_AXIS_ZXZ,
  KSL_AXIS_ZYZ,
  KSL_AXIS_INVALID = 12
} ksl_axis_enum_t;

/** How a matrix lies in memory, and how it is printed (print.h). */
typedef enum ksl_matrix_enum_t { KSL_ROW_MAJOR = 0, KSL_COLUMN_MAJOR } ksl_matrix_enum_t;

#undef KSL_VIEW
#if !defined(__cplusplus) && defined(__GNUC__) && __STDC_VERSION__ < 201112L
#pragma GCC diagnostic pop
#endif

#endif
