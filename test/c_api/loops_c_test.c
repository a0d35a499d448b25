/* A four-bar from C: crank 0.2 m 1 kg, coupler 0.6 m 2 kg, rocker 0.5 m 1.5 kg, ground 0.6 m, slender rods, axes y, gravity −z.  Values of two
   other programs and of planar equations: with no torque the accelerations below, the coupler pushed by (3.772624394349, 0,
   7.538524905281) N at the closure; at constant 8 rad/s the crank needs −4.3331141856 N m.  Returns 1 if a check fails. */
#include "c_checks.h"

#include <ksl/ksl.h>

static const double y[3] = {0, 1, 0};
static const double q[3] = {-1.047197551197, 0.471236417257, -1.564393222866};
static const double v[3] = {8, -9.578753074881, 1.739492348256};
static const double a[3] = {65.268101754609, -98.97355951642, -14.708667649879};

static int near(double x, double expected, double limit) {
  return fabs(x - expected) <= limit * fmax(1, fabs(expected));
}

static ksl_SE3_t along_x(double x) { return ksl_SE3_fromRt(ksl_mat3x3(1, 0, 0, 0, 1, 0, 0, 0, 1), ksl_vec3(x, 0, 0)); }

static ksl_model_t *four_bar(void) {
  const char *names[] = {"crank", "coupler", "rocker"}, *drives[] = {"A"};
  const double mass[] = {1, 2, 1.5}, length[] = {0.2, 0.6, 0.5};
  const ksl_SE3_t at_B = along_x(0.2), at_D = along_x(0.6), at_C = along_x(0.6), on_rocker = along_x(0.5);
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_joint_options_t hinge = ksl_joint_options();
  ksl_loop_options_t about_y = ksl_loop_options();
  hinge.axis = about_y.axis = y;
  CHECK(ksl_builder_create("four-bar", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "ground", NULL) == KSL_OK);
  for (int i = 0; i < 3; ++i) {
    const double I = mass[i] * length[i] * length[i] / 12;
    const ksl_link_mass_t rod = {mass[i], {length[i] / 2, 0, 0}, {{0, 0, 0}, {0, I, 0}, {0, 0, I}}};
    CHECK(ksl_builder_add_link(b, names[i], &rod) == KSL_OK);
  }
  CHECK(ksl_builder_add_joint(b, "A", "continuous", "ground", "crank", NULL, &hinge) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "B", "continuous", "crank", "coupler", &at_B, &hinge) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "D", "continuous", "ground", "rocker", &at_D, &hinge) == KSL_OK);
  CHECK(ksl_builder_add_loop(b, "C", "revolute", "rocker", "coupler", &on_rocker, &at_C, &about_y) == KSL_OK);
  CHECK(ksl_builder_set_drives(b, 1, drives) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK);
  ksl_builder_free(b);
  return m;
}

static void test_dynamics(const ksl_model_t *m, ksl_data_t *d) {
  const double zero[3] = {0, 0, 0};
  double closed[3], speed[3], found[3], tau[3], wrench[6];
  ksl_closing_t end;
  double error = 1;
  const bool crank[3] = {true, false, false};
  CHECK(ksl_close(m, d, q, crank, false, closed, &end, &error) == KSL_OK && end == KSL_CLOSED && error < 1e-12);
  CHECK(ksl_consistent_velocity(m, d, closed, v, crank, speed) == KSL_OK);
  for (int i = 0; i < 3; ++i)
    CHECK(near(closed[i], q[i], 1e-11) && near(speed[i], v[i], 1e-10));
  CHECK(ksl_forward_dynamics(m, d, closed, speed, zero, NULL, found) == KSL_OK);
  for (int i = 0; i < 3; ++i)
    CHECK(near(found[i], a[i], 1e-9));
  /* the closure: what the rocker exerts on the coupler, in world axes */
  const int loop = ksl_model_joints(m);
  ksl_reaction_options_t in_world = {0};
  in_world.axes = KSL_WORLD;
  CHECK(ksl_inverse_dynamics_with_reactions(m, d, closed, speed, found, NULL, tau, 1, &loop, &in_world, wrench) ==
        KSL_OK);
  CHECK(near(wrench[0], 3.772624394349, 1e-9) && near(wrench[2], 7.538524905281, 1e-9));
  for (int i = 0; i < 3; ++i)
    CHECK(fabs(tau[i]) < 1e-9);
  CHECK(ksl_consistent_acceleration(m, d, closed, speed, zero, crank, found) == KSL_OK);
  CHECK(ksl_inverse_dynamics(m, d, closed, speed, found, NULL, tau) == KSL_OK);
  CHECK(near(tau[0], -4.3331141856, 1e-9) && tau[1] == 0 && tau[2] == 0);
  CHECK_REFUSED(ksl_reactions(m, d, 1, &loop, NULL, NULL, wrench), KSL_FAILED, "inverse_dynamics_with_reactions");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, zero, zero, zero, NULL, tau), KSL_NOT_FINITE, "loop joint C is open");
  CHECK_REFUSED(ksl_mass_matrix(m, d, closed, tau), KSL_FAILED, "not available for mechanisms with loops");
}

/* Efforts and the wrench at the closure by the parameters of rods: mass, m l / 2 along x, m l² / 3 about y and z. */
static void test_regressors(const ksl_model_t *m, ksl_data_t *d) {
  const double zero[3] = {0, 0, 0};
  const bool crank[3] = {true, false, false};
  double closed[3], speed[3], found[3], tau[3], wrench[6], error;
  ksl_closing_t end;
  const int loop = ksl_model_joints(m);
  ksl_reaction_options_t in_world = {0};
  in_world.axes = KSL_WORLD;
  CHECK(ksl_close(m, d, q, crank, false, closed, &end, &error) == KSL_OK);
  CHECK(ksl_consistent_velocity(m, d, closed, v, crank, speed) == KSL_OK);
  CHECK(ksl_consistent_acceleration(m, d, closed, speed, zero, crank, found) == KSL_OK);
  const int links[] = {1, 2, 3};
  const double rods[3][2] = {{1, 0.2}, {2, 0.6}, {1.5, 0.5}};
  double by_efforts[3][3][10], by_wrench[6][4][10], sums[9] = {0};
  CHECK(ksl_inverse_dynamics_regressor(m, d, closed, speed, found, 3, links, &by_efforts[0][0][0]) == KSL_OK);
  CHECK(ksl_reactions_regressor(m, d, closed, speed, found, 1, &loop, &in_world, &by_wrench[0][0][0]) == KSL_OK);
  CHECK(ksl_inverse_dynamics_with_reactions(m, d, closed, speed, found, NULL, tau, 1, &loop, &in_world, wrench) ==
        KSL_OK);
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 3; ++k) {
      const double *const y_of = i < 3 ? by_efforts[i][k] : by_wrench[i - 3][k + 1];
      const double mass = rods[k][0], length = rods[k][1];
      sums[i] += mass * (y_of[0] + length / 2 * y_of[1] + length * length / 3 * (y_of[6] + y_of[9]));
    }
  for (int i = 0; i < 9; ++i)
    CHECK(near(sums[i], i < 3 ? tau[i] : wrench[i - 3], 1e-9));
  CHECK_REFUSED(ksl_inverse_dynamics_regressor(m, d, zero, zero, zero, 3, links, &by_efforts[0][0][0]), KSL_NOT_FINITE,
                "loop joint C is open");
}

static void test_geometry(const ksl_model_t *m, ksl_data_t *d) {
  ksl_mobility_t mobility;
  int redundant[5], indices[3], n = 0;
  double closed[3], errors[5], J[15], rate[5], jump[3], patterns[3 * 9 * 6], by_q[3], by_v[3], by_a[3], by_tau[9];
  ksl_closing_t end;
  CHECK(ksl_model_loops(m) == 1 && ksl_model_loop_rows(m) == 5 && strcmp(ksl_model_loop_name(m, 0), "C") == 0);
  CHECK(ksl_model_loop_name(m, 1) == NULL);
  CHECK(ksl_close(m, d, q, NULL, true, closed, &end, NULL) == KSL_OK && end == KSL_CLOSED);
  double in_place[3] = {-1.3, 0.9, -1.2}, apart[3];
  CHECK(ksl_close(m, d, in_place, NULL, false, apart, &end, NULL) == KSL_OK && end == KSL_CLOSED);
  CHECK(ksl_close(m, d, in_place, NULL, false, in_place, &end, NULL) == KSL_OK &&
        memcmp(in_place, apart, sizeof apart) == 0);
  CHECK(ksl_mobility(m, d, closed, &mobility, redundant) == KSL_OK);
  CHECK(mobility.mobility == 1 && mobility.rank == 2 && mobility.redundant == 3 && mobility.next < 1e-12);
  CHECK(ksl_independent(m, d, closed, indices, &n) == KSL_OK && n == 1 && indices[0] == 0);
  CHECK(ksl_loop_error(m, d, closed, errors) == KSL_OK && ksl_loop_jacobian(m, d, closed, J) == KSL_OK);
  CHECK(ksl_consistent_velocity(m, d, closed, v, (const bool[]){true, false, false}, jump) == KSL_OK);
  CHECK(ksl_consistent_acceleration(m, d, closed, jump, a, (const bool[]){true, false, false}, by_q) == KSL_OK);
  CHECK(ksl_loop_acceleration(m, d, closed, jump, by_q, rate) == KSL_OK);
  for (int i = 0; i < 5; ++i)
    CHECK(fabs(errors[i]) < 1e-12 &&
          fabs(J[3 * i] * jump[0] + J[3 * i + 1] * jump[1] + J[3 * i + 2] * jump[2]) < 1e-12 && fabs(rate[i]) < 1e-9);
  CHECK(ksl_reaction_patterns(m, d, closed, patterns, &n) == KSL_OK && n == 3);
  CHECK(ksl_closed_inverse_dynamics_derivatives(m, d, closed, jump, by_q, NULL, by_v, by_a, by_tau) == KSL_OK);
  const double inertia = by_tau[0];
  CHECK(inertia > 0 && by_tau[1] == 0 && by_tau[2] == 0);
  CHECK(ksl_closed_forward_dynamics_derivatives(m, d, closed, jump, by_v, NULL, by_q, by_a, by_tau) == KSL_OK);
  CHECK(near(by_tau[0] * inertia, 1, 1e-9));
  CHECK(ksl_forward_dynamics(m, d, closed, jump, by_v, NULL, rate) == KSL_OK);
  CHECK(ksl_stabilised_forward_dynamics(m, d, closed, jump, by_v, NULL, 10, 10, errors) == KSL_OK);
  for (int i = 0; i < 3; ++i)
    CHECK(near(errors[i], rate[i], 1e-9));
  CHECK_REFUSED(ksl_stabilised_forward_dynamics(m, d, closed, jump, by_v, NULL, -1, 0, errors), KSL_BAD_ARGUMENT,
                "gains");
  CHECK_REFUSED(
      ksl_consistent_velocity(m, d, closed, (const double[]){1, 1, 1}, (const bool[]){true, true, true}, jump),
      KSL_BAD_ARGUMENT, "no motion of the closed mechanism");
  CHECK_REFUSED(ksl_loop_error(m, d, NULL, errors), KSL_BAD_ARGUMENT, "null");
}

/* The variations are those of the closure's reactions, in components that are determined: by a they are linear, by v quadratic. */
static void test_variations(const ksl_model_t *m, ksl_data_t *d) {
  const bool crank[3] = {true, false, false};
  double closed[3], found[3], motions[3][3][3], on_links[3][2][6], at_joints[3][6], wrenches[2][6], w[2][6], tau[3];
  const int loop = ksl_model_joints(m);
  CHECK(ksl_close(m, d, q, crank, false, closed, &(ksl_closing_t){KSL_CLOSED}, NULL) == KSL_OK);
  double speed[3];
  CHECK(ksl_consistent_velocity(m, d, closed, v, crank, speed) == KSL_OK);
  CHECK(ksl_consistent_acceleration(m, d, closed, speed, a, crank, found) == KSL_OK);
  CHECK(ksl_closed_reaction_variations(m, d, closed, speed, found, NULL, &motions[0][0][0], &on_links[0][0][0],
                                       at_joints[0], wrenches[0]) == KSL_OK);
  CHECK(motions[0][0][0] == 1 && motions[1][1][0] == 1 && motions[2][2][0] == 1 && motions[2][0][1] == 0);
  for (int by = 1; by < 3; ++by) { /* by v and by a */
    for (int side = 0; side < 2; ++side) {
      const double step = by == 1 ? side - 0.5 : side;
      double at[2][3];
      for (int i = 0; i < 3; ++i)
        at[0][i] = speed[i] + step * motions[by][1][i], at[1][i] = found[i] + step * motions[by][2][i];
      CHECK(ksl_consistent_velocity(m, d, closed, at[0], crank, at[0]) == KSL_OK);            /* in place */
      CHECK(ksl_consistent_acceleration(m, d, closed, at[0], at[1], crank, at[1]) == KSL_OK); /* with its square of v */
      CHECK(ksl_inverse_dynamics_with_reactions(m, d, closed, at[0], at[1], NULL, tau, 1, &loop, NULL, w[side]) ==
            KSL_OK);
    }
    for (int i = 0; i < 3; i += 2)
      CHECK(near(w[1][i] - w[0][i], at_joints[by][i], 1e-9));
  }
  CHECK_REFUSED(ksl_closed_reaction_variations(m, d, closed, speed, NULL, NULL, &motions[0][0][0], &on_links[0][0][0],
                                               at_joints[0], wrenches[0]),
                KSL_BAD_ARGUMENT, "null");
}

int main(void) {
  ksl_model_t *m = four_bar();
  ksl_data_t *d = NULL;
  CHECK(ksl_data_create(m, &d) == KSL_OK);
  test_dynamics(m, d);
  test_regressors(m, d);
  test_geometry(m, d);
  test_variations(m, d);
  ksl_data_free(d);
  ksl_model_free(m);
  return exit_status();
}
