/* A program as users of the published library wrote them, in its names and habits; contract/compat_test.py builds it,
   with headers by their bare names (-DBARE) and as <ksl/...>, and compares what it prints.  It uses nothing but what the
   published library declares and defines, and must never need a change. */
#ifdef BARE
#include <SE3.h>
#include <array.h>
#include <axis.h>
#include <coscrew.h>
#include <inertia.h>
#include <linalg.h>
#include <mat3x3.h>
#include <mat4x4.h>
#include <matrix.h>
#include <memory.h>
#include <print.h>
#include <quaternion.h>
#include <screw.h>
#include <trig.h>
#include <vec3.h>
#include <vec4.h>
#else
#include <ksl/ksl.h>
#include <ksl/memory.h>
#include <ksl/trig.h>
#endif

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void vectors(void) {
  ksl_vec3_t a = {{{1.0, 2.0, 3.0}}}; /* union, anonymous struct, array */
  ksl_vec3_t b = ksl_vec3(-1.0, 0.5, 2.0);
  ksl_vec3_t c;
  ksl_cross_vv(&a, &b, &c);
  ksl_axpy_vv(2.0, &a, &c);
  ksl_vec3_print(stdout, &c, "2a + a x b: ");
  printf("a.b %g, |a|^2 %g, a[2] %g, as r of a vec4 %g\n", ksl_dot_vv(&a, &b), ksl_dot_vv(&a, &a), a.at[2],
         ksl_vec4(4, 5, 6, 7).r.y);
  ksl_vec3_normalize(&a);
  printf("unit %d\n", fabs(ksl_vec3_l2norm(&a) - 1.0) < 1e-15);
  ksl_vec3f_t f = ksl_vec3f(0.5f, 0.25f, 0.125f);
  ksl_vec3f_scale(&f, 2.0f);
  ksl_vec3f_print(stdout, &f, "float: ");
  ksl_vec4i_t indices = ksl_vec4i(1, 2, 3, 4);
  ksl_vec3i_t first = indices.r;
  printf("indices %d %d\n", indices.r.z, ksl_vec3i_isEqual(&first, &indices.r));
  ksl_vec3_t *many = ksl_vec3_alloc(10);
  printf("zero %g\n", many[9].z);
  free(many);
}

static void poses(void) {
  double dc[2];
  ksl_dc(M_PI / 2.0, dc);
  ksl_mat3x3_t R, I = ksl_mat3x3(1, 0, 0, 0, 1, 0, 0, 0, 1);
  ksl_product_drdrz(&I, dc, &R);
  ksl_SE3_t D = ksl_SE3(0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3), E, F;
  const double none[2] = {0.0, 1.0}; /* a table of the program's own */
  ksl_product_drdrx(&R, none, &R);
  ksl_SE3_t G = {{{0, 1, 0, -1, 0, 0, 0, 0, 1, 1, 2, 3}}}; /* by columns */
  ksl_SE3_inverted(&D, &E);
  ksl_product_dd(&D, &E, &F);
  ksl_SE3_print(stdout, &G, "D = ");
  ksl_SE3_print(stdout, &F, "D D^-1 = ");
  printf("same %d %d\n", ksl_allclose(12, D.as_array, G.as_array), ksl_allclose(9, R.as_array, D.R.as_array));
  ksl_product_ddtx(&D, 2.0, &E);
  ksl_vec3_print(stdout, &E.t, "moved: ");
  ksl_mat4x4_t M = ksl_mat4x4_fromSE3(D);
  printf("%g %g %g\n", ksl_mat4x4_get(&M, 1, 3), M.v3.w, ksl_SE3_get(&D, 2, 3));
  ksl_vec3_t angles;
  ksl_mat3x3_getEulerAngles(&R, KSL_AXIS_ZYX, &angles);
  printf("zyx %.4f %.4f %.4f\n", angles.x, fabs(angles.y), fabs(angles.z));
  ksl_axis_enum_t sequence = KSL_AXIS_ZYX;
  ksl_vec3i_t axes = ksl_axis_getVector(sequence);
  printf("axes %d %d %d, %d\n", axes.x, axes.y, axes.z,
         ksl_axis_getEulerAngles(axes) == KSL_AXIS_ZYX && KSL_AXIS_ZYZ != KSL_AXIS_INVALID);
  ksl_vec3_t axis = ksl_vec3(0, 0, 1), found;
  double angle;
  ksl_mat3x3_setFromAxisAngle(&R, &axis, 0.3);
  ksl_mat3x3_getAxisAngle(&R, &found, &angle);
  printf("angle %.4f about %.4f, det %.4f\n", angle, found.z, ksl_mat3x3_determinant(&R));
}

static void screws(void) {
  ksl_SE3_t D = ksl_SE3_fromRt(ksl_mat3x3(0, -1, 0, 1, 0, 0, 0, 0, 1), ksl_vec3(1, 2, 3));
  ksl_screw_t s = {{{1, 2, 3, 0.5, 0, 1}}}, s2, h;
  ksl_coscrew_t c = ksl_coscrew(10, 0, 0, 0, 0, 0), c2, c3;
  ksl_product_Ads(&D, &s, &s2);
  ksl_product_CoAdc(&D, &c, &c2);
  ksl_screw_print(stdout, &s2, "Ad s = ");
  ksl_coscrew_print(stdout, &c2, "CoAd c = ");
  printf("power %g %g\n", ksl_dot_cs(&c, &s), ksl_dot_cs(&c2, &s2));
  ksl_hsrz(&D, &h);
  ksl_screw_print(stdout, &h, "turning about z: ");
  ksl_cross_ss(&s, &h, &s2);
  ksl_cross_sc(&s, &c, &c3);
  printf("%g %g, norm %g\n", s2.lin.x, c3.ang.z, ksl_coscrew_norm(&c3));
  double J[12] = {0};
  ksl_screw_copy_cmo(&h, J, 0, 1, 6);
  ksl_array2D_print(stdout, 2, 6, J, "J^T = ");
  ksl_screw_normalize(&h);
  ksl_xpy_ss(&s, &h);
  printf("%g\n", h.m5);
}

static void quaternions(void) {
  ksl_quaternion_t q = {{0, 0, 0, 1}}, p = ksl_quaternion(0, 0, 1, 1),
                   r; /* this union has no anonymous struct around at */
  ksl_mat3x3_t R;
  ksl_quaternion_normalize(&p);
  /* the published library has no quaternion product in double that links */
  ksl_quaternionf_t f = ksl_quaternionf(0, 0, (float)p.z, (float)p.w), g;
  ksl_product_qqf(&f, &f, &g);
  r = ksl_quaternion(g.x, g.y, g.z, g.w);
  ksl_quaternion_toMat3x3(&r, &R);
  printf("half a turn: %.3f %.3f %.3f, %.3f\n", R.m00, R.m11, R.m22, ksl_dot_qq(&q, &p));
  ksl_mat3x3_toQuaternion(&R, &r);
  printf("back: %.3f\n", fabs(r.z));
  double t = 0.5;
  ksl_quaternion_nlerp(&q, &p, &t, &r);
  printf("between: %.6f %.6f\n", r.r.z, r.w);
}

static void inertias(void) {
  ksl_inertia_t M = ksl_inertia(2.0, ksl_vec3(0, 0, 0), 1, 2, 3, 0, 0, 0), N;
  ksl_mat3x3_t R = ksl_mat3x3(0, -1, 0, 1, 0, 0, 0, 0, 1);
  ksl_vec3_t t = ksl_vec3(1, 0, 0);
  ksl_inertia_rotated(&M, &R, &N);
  printf("turned %g %g %g\n", N.Ixx, N.Iyy, N._Izz);
  ksl_inertia_translated(&M, &t, &N);
  printf("moved %g %g %g, mr %g, m %g\n", N.Ixx, N.Iyy, N.Izz, N.mr.x, N.mass);
}

static void numbers(void) {
  double A[9] = {4, 1, 0, 1, 3, 1, 0, 1, 2}, b[3] = {1, 2, 3}, x[3];
  printf("ldlt %d", ksl_linalg_ldlt_rmo(A, 3));
  ksl_linalg_ldlt_solve_rmo(A, b, x, 3);
  printf(" x %.4f %.4f %.4f\n", x[0], x[1], x[2]);
  double B[12] = {1, 2, 3, 6, 4, 5, 6, 15, 7, 8, 10, 25};
  int pr[3], pc[4];
  int rank = ksl_linalg_lu_full_specified_rmo(3, 4, B, 1e-12, pr, pc, 3);
  ksl_linalg_lu_setBMatrix_rmo(rank, 4, B);
  for (int i = 0; i < 3; i++)
    x[pc[i]] = B[i * 4 + 3];
  printf("rank %d x %.4f %.4f %.4f\n", rank, x[0], x[1], x[2]);
  double **table = ksl_array2D_alloc(2, 3);
  table[1][0] = 5.0;
  printf("%g %g\n", table[0][3], table[1][2]);
  ksl_array2D_free(table);
  int n[3] = {3, 1, 2};
  ksl_arrayi_print(stdout, 3, n, "n = ");
  printf("largest %d, %g, %.6f\n", ksl_maxIndex(3, b), ksl_normalizeDegrees(-90.0), catan2pi(0.0, 1.0, 6.0));
}

static void printing(void) {
  ksl_vec3_t v = ksl_vec3(0.5, 1, 2);
  ksl_print_options_t *options = ksl_print_options();
  ksl_print_setDelimiter("; ", options);
  ksl_print_setOuterBrackets("<", ">", options);
  ksl_vec3_print(stdout, &v, "v ", options);
  ksl_print_setRealFormat("%.2f");
  ksl_vec3_print(stdout, &v);
  ksl_vec3_debug(stdout, &v, "debug ");
  ksl_print_setDefaultOptions();
  ksl_mat3x3_t R = ksl_mat3x3(1, 2, 3, 4, 5, 6, 7, 8, 9);
  ksl_mat3x3_print(stdout, &R);
  ksl_eulerangles_t angles = {{{{1, 2, 3}}}, KSL_AXIS_XYZ};
  ksl_eulerangles_print(stdout, &angles);
  free(options);
}

int main(void) {
  vectors();
  poses();
  screws();
  quaternions();
  inertias();
  numbers();
  printing();
  return 0;
}
