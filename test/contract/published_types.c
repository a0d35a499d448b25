/* The published types: every member by its name, at its place; sizes and alignments.  C11 and C++20 compile it. */
/* clang-format off */
#include <ksl/ksl.h>
#include <stddef.h>

#ifndef __cplusplus
#define static_assert _Static_assert
#define alignof _Alignof
#endif
#define SIZE(type, n) \
  static_assert(sizeof(ksl_##type##_t) == (n) * sizeof(double) && alignof(ksl_##type##_t) == alignof(double), ""); \
  static_assert(sizeof(ksl_##type##f_t) == (n) * sizeof(float) && alignof(ksl_##type##f_t) == alignof(float), "")
#define AT(type, member, n) \
  static_assert(offsetof(ksl_##type##_t, member) == (n) * sizeof(double), ""); \
  static_assert(offsetof(ksl_##type##f_t, member) == (n) * sizeof(float), "")

SIZE(vec3, 3); AT(vec3, at, 0); AT(vec3, x, 0); AT(vec3, y, 1); AT(vec3, z, 2);
SIZE(vec4, 4); AT(vec4, at, 0); AT(vec4, r, 0); AT(vec4, x, 0); AT(vec4, y, 1); AT(vec4, z, 2); AT(vec4, w, 3);
SIZE(quaternion, 4); AT(quaternion, at, 0); AT(quaternion, r, 0); AT(quaternion, x, 0); AT(quaternion, y, 1); AT(quaternion, z, 2);
AT(quaternion, w, 3);
SIZE(mat3x3, 9); AT(mat3x3, as_array, 0); AT(mat3x3, at[1][2], 5); AT(mat3x3, m00, 0); AT(mat3x3, m10, 1); AT(mat3x3, m20, 2);
AT(mat3x3, m01, 3); AT(mat3x3, m11, 4); AT(mat3x3, m21, 5); AT(mat3x3, m02, 6); AT(mat3x3, m12, 7); AT(mat3x3, m22, 8);
AT(mat3x3, v0, 0); AT(mat3x3, v1, 3); AT(mat3x3, v2, 6); AT(mat3x3, v[2], 6);
SIZE(mat4x4, 16); AT(mat4x4, as_array, 0); AT(mat4x4, at[3][1], 13); AT(mat4x4, m00, 0); AT(mat4x4, m10, 1); AT(mat4x4, m20, 2);
AT(mat4x4, m30, 3); AT(mat4x4, m01, 4); AT(mat4x4, m11, 5); AT(mat4x4, m21, 6); AT(mat4x4, m31, 7); AT(mat4x4, m02, 8);
AT(mat4x4, m12, 9); AT(mat4x4, m22, 10); AT(mat4x4, m32, 11); AT(mat4x4, m03, 12); AT(mat4x4, m13, 13); AT(mat4x4, m23, 14);
AT(mat4x4, m33, 15); AT(mat4x4, v0, 0); AT(mat4x4, v1, 4); AT(mat4x4, v2, 8); AT(mat4x4, v3, 12); AT(mat4x4, v[3].w, 15);
SIZE(SE3, 12); AT(SE3, as_array, 0); AT(SE3, at[3][2], 11); AT(SE3, R, 0); AT(SE3, t, 9); AT(SE3, m00, 0); AT(SE3, m10, 1);
AT(SE3, m20, 2); AT(SE3, m01, 3); AT(SE3, m11, 4); AT(SE3, m21, 5); AT(SE3, m02, 6); AT(SE3, m12, 7); AT(SE3, m22, 8);
AT(SE3, m03, 9); AT(SE3, m13, 10); AT(SE3, m23, 11); AT(SE3, v0, 0); AT(SE3, v1, 3); AT(SE3, v2, 6); AT(SE3, v3, 9); AT(SE3, v[3], 9);
SIZE(screw, 6); AT(screw, at, 0); AT(screw, lin, 0); AT(screw, ang, 3); AT(screw, m0, 0); AT(screw, m1, 1); AT(screw, m2, 2);
AT(screw, m3, 3); AT(screw, m4, 4); AT(screw, m5, 5);
SIZE(coscrew, 6); AT(coscrew, at, 0); AT(coscrew, lin, 0); AT(coscrew, ang, 3); AT(coscrew, m0, 0); AT(coscrew, m1, 1);
AT(coscrew, m2, 2); AT(coscrew, m3, 3); AT(coscrew, m4, 4); AT(coscrew, m5, 5);
SIZE(inertia, 10); AT(inertia, at, 0); AT(inertia, m, 0); AT(inertia, mt, 1); AT(inertia, Ixx, 4); AT(inertia, Iyy, 5);
AT(inertia, Izz, 6); AT(inertia, Ixy, 7); AT(inertia, Iyz, 8); AT(inertia, Izx, 9); AT(inertia, mass, 0); AT(inertia, mr, 1);
AT(inertia, _Ixx, 4); AT(inertia, _Iyy, 5); AT(inertia, _Izz, 6); AT(inertia, Iyx, 7); AT(inertia, Izy, 8); AT(inertia, Ixz, 9);

static_assert(sizeof(ksl_vec3i_t) == 3 * sizeof(int) && offsetof(ksl_vec3i_t, z) == 2 * sizeof(int) && offsetof(ksl_vec3i_t, at[1]) == sizeof(int), "");
static_assert(sizeof(ksl_vec4i_t) == 4 * sizeof(int) && offsetof(ksl_vec4i_t, w) == 3 * sizeof(int) && offsetof(ksl_vec4i_t, at[1]) == sizeof(int), "");
static_assert(offsetof(ksl_vec4i_t, r) == 0 && offsetof(ksl_vec4i_t, r.z) == 2 * sizeof(int) && sizeof(((ksl_vec4i_t *)0)->r) == sizeof(ksl_vec3i_t), "");
static_assert(sizeof(ksl_eulerangles_t) == 32 && sizeof(ksl_euleranglesf_t) == 16, "");
static_assert(offsetof(ksl_eulerangles_t, angles) == 0 && offsetof(ksl_eulerangles_t, axis) == 24, "");
static_assert(sizeof(ksl_print_options_t) == 908, "");
static_assert(offsetof(ksl_print_options_t, delimiter) == 0 && offsetof(ksl_print_options_t, real_fmt) == 100 &&
              offsetof(ksl_print_options_t, int_fmt) == 200 && offsetof(ksl_print_options_t, true_fmt) == 300 &&
              offsetof(ksl_print_options_t, false_fmt) == 400 && offsetof(ksl_print_options_t, inner_left_bracket) == 500 &&
              offsetof(ksl_print_options_t, inner_right_bracket) == 600 && offsetof(ksl_print_options_t, outer_left_bracket) == 700 &&
              offsetof(ksl_print_options_t, outer_right_bracket) == 800 && offsetof(ksl_print_options_t, line_breaks_in_matrices) == 900 &&
              offsetof(ksl_print_options_t, print_row_column_major) == 904, "");

static_assert((int)KSL_AXIS_XYZ == 0 && (int)KSL_AXIS_YZX == 1 && (int)KSL_AXIS_ZXY == 2 && (int)KSL_AXIS_XZY == 3 && (int)KSL_AXIS_YXZ == 4 &&
              (int)KSL_AXIS_ZYX == 5 && (int)KSL_AXIS_XYX == 6 && (int)KSL_AXIS_XZX == 7 && (int)KSL_AXIS_YXY == 8 && (int)KSL_AXIS_YZY == 9 &&
              (int)KSL_AXIS_ZXZ == 10 && (int)KSL_AXIS_ZYZ == 11 && (int)KSL_AXIS_INVALID == 12, "");
static_assert((int)KSL_NO_BREAK_BETWEEN_LINES == 0 && (int)KSL_BREAK_BETWEEN_LINES == 1 && (int)KSL_ROW_MAJOR == 0 && (int)KSL_COLUMN_MAJOR == 1, "");

/* a program that calls every published macro */
#define PRINT(type, name) ksl_##type##_print(file, name); ksl_##type##_debug(file, name, "label"); ksl_##type##_print(file, name, "label", options)

void macros(FILE *file, ksl_vec3_t *v, ksl_vec4_t *w, ksl_quaternion_t *q, ksl_mat3x3_t *R, ksl_mat4x4_t *M, ksl_SE3_t *D, ksl_screw_t *s,
            ksl_coscrew_t *c, ksl_inertia_t *I, ksl_eulerangles_t *e, double *a, int *i, bool *b, ksl_print_options_t *options);
void macros(FILE *file, ksl_vec3_t *v, ksl_vec4_t *w, ksl_quaternion_t *q, ksl_mat3x3_t *R, ksl_mat4x4_t *M, ksl_SE3_t *D, ksl_screw_t *s,
            ksl_coscrew_t *c, ksl_inertia_t *I, ksl_eulerangles_t *e, double *a, int *i, bool *b, ksl_print_options_t *options) {
  PRINT(vec3, v); PRINT(vec4, w); PRINT(quaternion, q); PRINT(mat3x3, R); PRINT(mat4x4, M); PRINT(SE3, D); PRINT(screw, s);
  PRINT(coscrew, c); PRINT(inertia, I); PRINT(eulerangles, e);
  ksl_array_print(file, 3, a); ksl_array_debug(file, 3, a, "label"); ksl_arrayi_print(file, 3, i); ksl_arrayi_debug(file, 3, i);
  ksl_array2D_print(file, 1, 3, a); ksl_array2D_debug(file, 1, 3, a, "label", options);
  ksl_triang_print(file, 2, a); ksl_triangi_print(file, 2, i); ksl_triangb_print(file, 2, b);
  ksl_triang_debug(file, 2, a); ksl_triangi_debug(file, 2, i); ksl_triangb_debug(file, 2, b);
  ksl_print_setDelimiter(" "); ksl_print_setRealFormat("%g", options); ksl_print_setInnerBrackets("(", ")"); ksl_print_setOuterBrackets("(", ")");
  ksl_print_setBreakBetweenLinesInMatrix(KSL_BREAK_BETWEEN_LINES); ksl_print_setBoolean("yes", "no", options);
  ksl_print_setRowColumnMajorPrinting(KSL_ROW_MAJOR);
  ksl_mat3x3_getEulerAngles(R, KSL_AXIS_ZYX, v); ksl_mat3x3_getEulerAngles(R, KSL_AXIS_ZYX, v, v);
}
