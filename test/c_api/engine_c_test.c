/* The C interface from C11, linked to the shared library.  Arguments: the folder of sample robots, a folder to write
   in.  Prints what fails; returns 1 if anything does, otherwise 0. */
#include "c_checks.h"

#include <ksl/engine.h>
#include <ksl/ksl.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char pendulum[] =
    "<robot name='p'><link name='ceiling'/><link name='bob'><inertial><origin xyz='0 0 -0.7'/><mass value='1.3'/>"
    "<inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link><link name='hand'/>"
    "<joint name='pin' type='continuous'><parent link='ceiling'/><child link='bob'/><axis xyz='0 1 0'/></joint>"
    "<joint name='weld' type='fixed'><origin xyz='0 0 -0.7'/><parent link='bob'/><child link='hand'/></joint></robot>";

static void test_pendulum(const char *path) {
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK);
  CHECK(ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  CHECK(ksl_model_nq(m) == 1 && ksl_model_nv(m) == 1 && ksl_model_moving_joints(m) == 1);
  CHECK(ksl_model_joints(m) == 3 && ksl_model_links(m) == 3);
  CHECK(!strcmp(ksl_model_joint_name(m, 0), "pin") && !strcmp(ksl_model_joint_name(m, 1), "weld"));
  CHECK(!strcmp(ksl_model_joint_name(m, 2), "base") && ksl_model_joint_name(m, 3) == NULL &&
        ksl_model_joint_name(m, -1) == NULL);
  CHECK(!strcmp(ksl_model_link_name(m, 0), "ceiling") && ksl_model_link_name(m, 3) == NULL &&
        ksl_model_link_name(m, -1) == NULL);
  CHECK(ksl_model_joint(m, "weld") == 1 && ksl_model_joint(m, "none") == -1 && ksl_model_joint(m, NULL) == -1);
  CHECK(ksl_model_link(m, "hand") == 2 && ksl_model_link(m, "none") == -1 && ksl_model_link(m, NULL) == -1);

  const double q = 0.8, v = 2.1, a = -1.7, g = 9.81, l = 0.7, mass = 1.3;
  const double pull = mass * (g * cos(q) + l * v * v), across = mass * (g * sin(q) + l * a);
  double tau, w[18], power = 7;
  CHECK(ksl_external_power(m, d, &q, &v, NULL, &power) == KSL_OK && power == 0); /* no wrench, no power */
  CHECK(ksl_inverse_dynamics(m, d, &q, &v, &a, NULL, &tau) == KSL_OK);
  CHECK(close_to(tau, l * across));
  const int joints[3] = {0, 1, 2};
  CHECK(ksl_reactions(m, d, 3, joints, NULL, NULL, w) == KSL_OK);
  CHECK(close_to(w[0], -across) && close_to(w[2], pull) && close_to(w[4], l * across) && close_to(w[1], 0));
  for (int i = 6; i < 12; ++i)
    CHECK(w[i] == 0); /* nothing hangs on the weld */

  double tau_too, w_too[18];
  CHECK(ksl_inverse_dynamics_with_reactions(m, d, &q, &v, &a, NULL, &tau_too, 3, joints, NULL, w_too) == KSL_OK);
  CHECK(tau_too == tau && memcmp(w_too, w, sizeof w) == 0);
  CHECK_REFUSED(ksl_inverse_dynamics_with_reactions(m, d, &q, &v, &a, NULL, &tau_too, 3, joints, NULL, NULL),
                KSL_BAD_ARGUMENT, "wrenches must not be null");

  ksl_reaction_options_t how = {0};
  how.part = KSL_CONSTRAINT;
  how.on = KSL_ON_PARENT;
  how.order = KSL_ANGULAR_FIRST;
  CHECK(ksl_reactions(m, d, 1, joints, &how, NULL, w) == KSL_OK);
  CHECK(w[1] == 0 && close_to(w[3], across) && close_to(w[5], -pull));
  memset(&how, 0, sizeof how);
  how.at = how.axes = KSL_LINK;
  how.at_link = how.axes_link = ksl_model_link(m, "hand");
  CHECK(ksl_reactions(m, d, 1, joints, &how, NULL, w) == KSL_OK);
  CHECK(close_to(w[2], pull) && close_to(w[4], 0)); /* the hand is where the mass is */
  memset(&how, 0, sizeof how);
  how.offset[2] = -0.7;
  CHECK(ksl_reactions(m, d, 1, joints, &how, NULL, w) == KSL_OK);
  CHECK(close_to(w[2], pull) && close_to(w[4], 0));
  how.at = how.axes = KSL_WORLD;
  CHECK(ksl_reactions(m, d, 1, joints, &how, NULL, w) == KSL_OK);
  CHECK(close_to(w[0], -across * cos(q) + pull * sin(q)) && close_to(w[4], l * across));

  const int hand = ksl_model_link(m, "hand");
  const ksl_coscrew_t push = ksl_coscrew(1, 2, 3, 4, 5, 6);
  const ksl_external_t external = {1, &hand, &push, KSL_IN_FRAME}, in_world = {1, &hand, &push, KSL_IN_WORLD};
  double pushed;
  CHECK(ksl_inverse_dynamics(m, d, &q, &v, &a, &in_world, &pushed) == KSL_OK);
  CHECK(close_to(pushed, tau - (5 - l * (1 * cos(q) - 3 * sin(q)))));
  CHECK(ksl_inverse_dynamics(m, d, &q, &v, &a, &external, &pushed) == KSL_OK);
  CHECK(close_to(pushed, tau - (5 - l * 1)));
  CHECK(ksl_reactions(m, d, 1, joints + 1, NULL, &external, w) == KSL_OK);
  for (int i = 0; i < 6; ++i)
    CHECK(close_to(w[i], -(i + 1.0)));

  ksl_SE3_t pose;
  CHECK(ksl_frame_pose(m, d, &q, hand, &pose) == KSL_OK);
  CHECK(close_to(pose.t.x, -l * sin(q)) && close_to(pose.t.z, -l * cos(q)) && close_to(pose.R.m00, cos(q)));
  const int two[2] = {hand, 0};
  double poses[2][4][4];
  CHECK(ksl_frame_poses(m, d, &q, 2, two, poses[0][0]) == KSL_OK);
  CHECK(poses[0][0][3] == pose.t.x && poses[0][2][3] == pose.t.z && poses[0][0][2] == pose.R.m02 &&
        poses[0][3][3] == 1);
  CHECK(poses[1][0][0] == 1 && poses[1][0][3] == 0 && poses[1][3][0] == 0); /* the ceiling */
  double kinetic, potential;
  CHECK(ksl_energy(m, d, &q, &v, &kinetic, &potential) == KSL_OK);
  CHECK(close_to(kinetic, mass * l * l * v * v / 2) && close_to(potential, -mass * g * l * cos(q)));

  CHECK_REFUSED(ksl_reactions(m, d, 1, joints, NULL, NULL, w), KSL_BAD_ARGUMENT,
                "call that first"); /* energy wrote there */
  CHECK(ksl_inverse_dynamics(m, d, &q, &v, &a, NULL, &tau) == KSL_OK);

  /* what is refused, and that it changes nothing */
  const double nan = NAN;
  const double infinite = INFINITY;
  tau = 7;
  CHECK_REFUSED(ksl_inverse_dynamics(NULL, d, &q, &v, &a, NULL, &tau), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_inverse_dynamics(m, NULL, &q, &v, &a, NULL, &tau), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, NULL, &v, &a, NULL, &tau), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, &q, &v, &a, NULL, NULL), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, &nan, &v, &a, NULL, &tau), KSL_BAD_ARGUMENT, "q[0]");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, &q, &infinite, &a, NULL, &tau), KSL_BAD_ARGUMENT, "v[0]");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, &q, &v, &nan, NULL, &tau), KSL_BAD_ARGUMENT, "a[0]");
  CHECK(tau == 7);
  const ksl_coscrew_t wrong = ksl_coscrew(1, 2, nan, 4, 5, 6);
  ksl_external_t bad = external;
  bad.wrench = &wrong;
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, &q, &v, &a, &bad, &tau), KSL_BAD_ARGUMENT, "external wrench[2]");

  CHECK_REFUSED(ksl_reactions(m, NULL, 3, joints, NULL, NULL, w), KSL_BAD_ARGUMENT, "null");
  CHECK(ksl_reactions(m, d, 0, NULL, NULL, NULL, NULL) == KSL_OK);
  memset(&how, 0, sizeof how);
  how.offset[1] = nan;
  CHECK_REFUSED(ksl_reactions(m, d, 1, joints, &how, NULL, w), KSL_BAD_ARGUMENT, "offset");

  const int nobody = 3;
  CHECK_REFUSED(ksl_frame_pose(m, d, &q, nobody, &pose), KSL_BAD_ARGUMENT, "out of range");
  CHECK_REFUSED(ksl_frame_pose(m, d, &q, 0, NULL), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_frame_poses(m, d, &q, 1, &nobody, poses[0][0]), KSL_BAD_ARGUMENT, "out of range");
  CHECK_REFUSED(ksl_frame_poses(m, d, &q, -1, two, poses[0][0]), KSL_BAD_ARGUMENT, "not negative");
  CHECK_REFUSED(ksl_frame_poses(m, d, &q, 1, NULL, poses[0][0]), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_frame_poses(m, d, &q, 1, two, NULL), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_frame_poses(m, d, &nan, 1, two, poses[0][0]), KSL_BAD_ARGUMENT, "q[0]");
  CHECK(ksl_frame_poses(m, d, &q, 0, NULL, NULL) == KSL_OK);
  CHECK_REFUSED(ksl_energy(m, d, &q, &nan, &kinetic, &potential), KSL_BAD_ARGUMENT, "v[0]");
  CHECK_REFUSED(ksl_energy(m, d, &q, &v, NULL, &potential), KSL_BAD_ARGUMENT, "null");
  ksl_data_free(d);
  ksl_model_free(m);
  ksl_data_free(NULL);
  ksl_model_free(NULL);
}

static void test_options(const char *path) {
  ksl_model_options_t options = ksl_model_options();
  CHECK(!options.floating_base && !options.mimic_independent && !options.strict && options.gravity[2] == -9.81);
  options.floating_base = true;
  options.gravity[2] = -1;
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, &options, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  CHECK(ksl_model_nq(m) == 8 && ksl_model_nv(m) == 7 && ksl_model_joint(m, "floating_base") == 0 &&
        ksl_model_joint(m, "base") == -1);
  const double q[8] = {0, 0, 0, 0, 0, 0, 1, 0}, zero[7] = {0};
  double tau[7];
  CHECK(ksl_inverse_dynamics(m, d, q, zero, zero, NULL, tau) == KSL_OK);
  CHECK(close_to(tau[2], 1.3));
  double at[8];
  const double uniform[8] = {0.5, 0.25, 0, 0.5, 0, 0, 0, 0.5}, beyond[8] = {1};
  CHECK(ksl_neutral(m, at) == KSL_OK && at[6] == 1 && at[0] == 0 && at[7] == 0);
  CHECK(ksl_random_position(m, uniform, at) == KSL_OK && at[0] == 0 && at[1] == 0.5 && at[2] == 1);
  CHECK(close_to(at[3] * at[3] + at[4] * at[4] + at[5] * at[5] + at[6] * at[6], 1));
  CHECK_REFUSED(ksl_random_position(m, beyond, at), KSL_BAD_ARGUMENT, "below 1");
  double multiplier = 7;
  CHECK(ksl_model_leader(m, 0, &multiplier, NULL) == -1 && multiplier == 0);
  const double flat[8] = {0};
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, flat, zero, zero, NULL, tau), KSL_BAD_ARGUMENT, "quaternion");
  ksl_data_free(d);
  ksl_model_free(m);
  options.gravity[0] = NAN;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_ARGUMENT, "gravity");
}

/* An SDF file with two models in a world that has its own gravity. */
static void test_sdf(const char *folder) {
  char path[4096];
  snprintf(path, sizeof path, "%s/two.sdf", folder);
  FILE *f = fopen(path, "w");
  CHECK(f != NULL);
  if (!f)
    return;
  fputs("<sdf version='1.9'><world name='w'><gravity>0 0 -2</gravity>", f);
  for (const char *name = "ab"; *name; ++name)
    fprintf(
        f,
        "<model name='%c'><link name='l'><inertial><mass>3</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>"
        "</inertial></link></model>",
        *name);
  fputs("</world></sdf>", f);
  fclose(f);
  ksl_model_options_t options = ksl_model_options();
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_DESCRIPTION, "several models, a, b");
  options.model_name = "b";
  const double q[7] = {0, 0, 0, 0, 0, 0, 1}, zero[6] = {0};
  double tau[6];
  for (int own = 0; own < 2; ++own) {
    options.file_gravity = own;
    CHECK(ksl_model_load(path, &options, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
    if (!m || !d)
      return;
    CHECK(ksl_model_joint(m, "floating_base") == 0 && ksl_model_nv(m) == 6);
    CHECK(ksl_inverse_dynamics(m, d, q, zero, zero, NULL, tau) == KSL_OK);
    CHECK(close_to(tau[2], own ? 6 : 3 * 9.81));
    ksl_data_free(d);
    ksl_model_free(m);
  }
}

static void test_masses(const char *folder) {
  char path[4096];
  snprintf(path, sizeof path, "%s/light.urdf", folder);
  FILE *f = fopen(path, "w");
  CHECK(f != NULL);
  if (!f)
    return;
  fputs("<robot name='light'><link name='a'/><link name='b'/><joint name='j' type='continuous'><parent "
        "link='a'/><child link='b'/></joint></robot>",
        f);
  fclose(f);
  ksl_model_options_t options = ksl_model_options();
  CHECK(!options.masses_optional);
  ksl_model_t *m = NULL;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_DESCRIPTION, "none of the links that move (b) has a mass");
  options.masses_optional = true;
  CHECK(ksl_model_load(path, &options, &m) == KSL_OK && ksl_model_warning(m, 0) &&
        strstr(ksl_model_warning(m, 0), "none of the links"));
  ksl_model_free(m);
}

/* A pendulum of 1.3 kg at 0.7 m carries 2 kg at 0.5 m below its hand: it is held level by the moments of both weights. */
static void test_payload(const char *path) {
  const ksl_payload_t load[2] = {{"hand", 1.5, {0, 0, -0.5}}, {"hand", 0.5, {0, 0, -0.5}}};
  ksl_model_options_t options = ksl_model_options();
  CHECK(options.payloads_n == 0);
  options.payloads_n = 2, options.payloads = load;
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, &options, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  const double level = -acos(0.0);
  double tau, M;
  CHECK(ksl_gravity_torque(m, d, &level, NULL, &tau) == KSL_OK);
  CHECK(close_to(fabs(tau), 9.81 * (1.3 * 0.7 + 2 * 1.2)));
  CHECK(ksl_mass_matrix(m, d, &level, &M) == KSL_OK);
  CHECK(close_to(M, 1.3 * 0.7 * 0.7 + 2 * 1.2 * 1.2));
  ksl_data_free(d);
  ksl_model_free(m);
  ksl_payload_t wrong = {"nobody", 1, {0, 0, 0}};
  options.payloads_n = 1, options.payloads = &wrong;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_DESCRIPTION, "no link nobody to carry the payload");
  wrong.link = "hand", wrong.mass = -1;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_ARGUMENT, "negative");
  wrong.mass = NAN;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_ARGUMENT, "payload mass");
  options.payloads = NULL;
  CHECK_REFUSED(ksl_model_load(path, &options, &m), KSL_BAD_ARGUMENT, "payloads_n");
}

static void test_files(const char *folder, const char *path) {
  ksl_model_t *m = (ksl_model_t *)&failures;
  CHECK_REFUSED(ksl_model_load("/nowhere/robot.urdf", NULL, &m), KSL_BAD_DESCRIPTION, "/nowhere/robot.urdf");
  CHECK(m == NULL);
  CHECK_REFUSED(ksl_model_load(NULL, NULL, &m), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_model_load(path, NULL, NULL), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_model_load(folder, NULL, &m), KSL_BAD_DESCRIPTION, folder);
}

static void test_sample_robot(const char *path) {
  ksl_model_t *m = NULL;
  ksl_data_t *one = NULL, *two = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK && ksl_data_create(m, &one) == KSL_OK &&
        ksl_data_create(m, &two) == KSL_OK);
  if (!m || !one || !two)
    return;
  const double x[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, y[6] = {0};
  double tau[6], other[6], again[6];
  CHECK(ksl_inverse_dynamics(m, one, x, x, x, NULL, tau) == KSL_OK);
  CHECK(ksl_inverse_dynamics(m, two, y, y, y, NULL, other) == KSL_OK);
  CHECK(ksl_inverse_dynamics(m, two, x, x, x, NULL, again) == KSL_OK);
  CHECK(!memcmp(tau, again, sizeof tau) &&
        memcmp(tau, other, sizeof tau)); /* a workspace keeps nothing from call to call */
  ksl_data_free(one);
  ksl_data_free(two);
  ksl_model_free(m);
}

/* Forward dynamics undoes inverse dynamics; M a + bias = tau; a batch gives the bits of its states. */
static void test_dynamics(const char *path) {
  enum { n = 3, nv = 6 };
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  double q[n][nv], v[n][nv], a[n][nv], tau[n][nv], back[nv], M[nv][nv], bias[nv], gravity[nv], batch[n][nv],
      Ms[n][nv][nv];
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < nv; ++i)
      q[k][i] = 0.3 * i - k, v[k][i] = 0.1 * k + 0.2, a[k][i] = 1.0 - 0.4 * i;
  CHECK(ksl_inverse_dynamics_batch(m, n, q[0], nv, v[0], nv, a[0], nv, batch[0], nv, 0) == KSL_OK);
  CHECK(ksl_mass_matrix_batch(m, n, q[0], nv, Ms[0][0], nv * nv, 1) == KSL_OK);
  for (int k = 0; k < n; ++k) {
    CHECK(ksl_inverse_dynamics(m, d, q[k], v[k], a[k], NULL, tau[k]) == KSL_OK);
    CHECK(!memcmp(tau[k], batch[k], sizeof tau[k]));
    CHECK(ksl_forward_dynamics(m, d, q[k], v[k], tau[k], NULL, back) == KSL_OK);
    CHECK(ksl_mass_matrix(m, d, q[k], M[0]) == KSL_OK && !memcmp(M, Ms[k], sizeof M));
    CHECK(ksl_bias(m, d, q[k], v[k], NULL, bias) == KSL_OK);
    for (int i = 0; i < nv; ++i) {
      double sum = bias[i];
      for (int j = 0; j < nv; ++j)
        sum += M[i][j] * a[k][j];
      CHECK(fabs(sum - tau[k][i]) < 1e-10 && fabs(back[i] - a[k][i]) < 1e-9);
    }
  }
  CHECK(ksl_forward_dynamics_batch(m, n, q[0], nv, v[0], nv, tau[0], nv, batch[0], nv, 0) == KSL_OK);
  CHECK(!memcmp(batch[n - 1], back, sizeof back));
  const double rest[nv] = {0};
  CHECK(ksl_gravity_torque(m, d, q[0], NULL, gravity) == KSL_OK && ksl_bias(m, d, q[0], rest, NULL, bias) == KSL_OK);
  CHECK(!memcmp(gravity, bias, sizeof bias));
  CHECK_REFUSED(ksl_mass_matrix(m, d, NULL, M[0]), KSL_BAD_ARGUMENT, "null");
  /* reactions belong to the inverse dynamics just before; a workspace belongs to one model */
  double wrench[6];
  const int first = 0;
  CHECK_REFUSED(ksl_reactions(m, d, 1, &first, NULL, NULL, wrench), KSL_BAD_ARGUMENT, "call that first");
  CHECK(ksl_inverse_dynamics(m, d, q[0], v[0], a[0], NULL, back) == KSL_OK);
  CHECK(ksl_reactions(m, d, 1, &first, NULL, NULL, wrench) == KSL_OK && wrench[5] == back[0]);
  ksl_model_t *same = NULL;
  CHECK(ksl_model_load(path, NULL, &same) == KSL_OK);
  CHECK_REFUSED(ksl_mass_matrix(same, d, q[0], M[0]), KSL_BAD_ARGUMENT, "made for another model");
  ksl_model_free(same);
  CHECK(ksl_model_nq(NULL) == 0 && ksl_model_joint(NULL, "x") == -1 && ksl_model_warning(m, 0) == NULL);
  CHECK_REFUSED(ksl_mass_matrix_batch(m, n, q[0], nv, NULL, nv, 1), KSL_BAD_ARGUMENT, "null");
  CHECK(strncmp(ksl_instruction_set(), "x86-64-v", 8) == 0 || strcmp(ksl_instruction_set(), "neon") == 0 ||
        strcmp(ksl_instruction_set(), "generic") == 0);
  ksl_data_free(d);
  ksl_model_free(m);
}

/* Poses and energies of a batch: the bits of its states, backwards and apart too; near those in single precision. */
static void test_positions_and_energies(const char *path) {
  enum { n = 3, nv = 6, links = 2, width = 16 * links };
  const int wanted[links] = {7, 2};
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  double q[n][nv], v[n][nv], poses[n][width + 1], energies[n][2], alone[width], kinetic, potential;
  float qf[n][nv], vf[n][nv], posesf[n][width], energiesf[n][2];
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < nv; ++i)
      q[k][i] = qf[k][i] = 0.25f * (float)i - (float)k, v[k][i] = vf[k][i] = 0.125f * (float)(k + i);
  CHECK(ksl_frame_poses_batch(m, n, q[n - 1], -nv, links, wanted, poses[0], width + 1, 0) == KSL_OK);
  CHECK(ksl_frame_poses_batchf(m, n, qf[0], nv, links, wanted, posesf[0], width, 1) == KSL_OK);
  CHECK(ksl_energy_batch(m, n, q[0], nv, v[0], nv, energies[0], 2, energies[0] + 1, 2, 0) == KSL_OK);
  CHECK(ksl_energy_batchf(m, n, qf[0], nv, vf[0], nv, energiesf[0], 2, energiesf[0] + 1, 2, 0) == KSL_OK);
  for (int k = 0; k < n; ++k) {
    CHECK(ksl_frame_poses(m, d, q[k], links, wanted, alone) == KSL_OK);
    CHECK(!memcmp(alone, poses[n - 1 - k], sizeof alone));
    for (int i = 0; i < width; ++i)
      CHECK(fabs((double)posesf[k][i] - alone[i]) < 1e-5);
    CHECK(ksl_energy(m, d, q[k], v[k], &kinetic, &potential) == KSL_OK);
    CHECK(energies[k][0] == kinetic && energies[k][1] == potential);
    CHECK(fabs((double)energiesf[k][0] - kinetic) < 1e-4 * kinetic + 1e-6 &&
          fabs((double)energiesf[k][1] - potential) < 1e-3);
  }
  const int nobody = ksl_model_links(m);
  CHECK_REFUSED(ksl_frame_poses_batch(m, n, q[0], nv, 1, &nobody, poses[0], width, 0), KSL_BAD_ARGUMENT,
                "out of range");
  CHECK_REFUSED(ksl_frame_poses_batch(m, n, q[0], nv, -1, wanted, poses[0], width, 0), KSL_BAD_ARGUMENT,
                "not negative");
  CHECK_REFUSED(ksl_frame_poses_batchf(m, n, NULL, nv, links, wanted, posesf[0], width, 0), KSL_BAD_ARGUMENT, "null");
  CHECK_REFUSED(ksl_energy_batch(NULL, n, q[0], nv, v[0], nv, energies[0], 2, energies[0] + 1, 2, 0), KSL_BAD_ARGUMENT,
                "null");
  CHECK_REFUSED(ksl_energy_batch(m, n, q[0], nv, v[0], nv, energies[0], 2, NULL, 2, 0), KSL_BAD_ARGUMENT, "null");
  CHECK(ksl_energy_batch(m, 0, NULL, nv, NULL, nv, NULL, 2, NULL, 2, 0) == KSL_OK);
  CHECK(ksl_frame_poses_batch(m, n, q[0], nv, 0, NULL, NULL, 0, 0) == KSL_OK);
  ksl_data_free(d);
  ksl_model_free(m);
}

/* With KSL_ISA=nonsense in the environment: no exception crosses the interface. */
static void test_unknown_instruction_set(const char *path) {
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  const double x[6] = {0};
  double tau[6];
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return;
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, x, x, x, NULL, tau), KSL_FAILED, "KSL_ISA=nonsense");
  CHECK_REFUSED(ksl_inverse_dynamics(m, d, x, x, x, NULL, tau), KSL_FAILED, "KSL_ISA=nonsense");
  CHECK(ksl_instruction_set() == NULL);
  ksl_data_free(d);
  ksl_model_free(m);
}

/* tau = m g l sin q + damping v + F v/|v| + N^2 I a of the pendulum, with and without its rotor as a body. */
static void test_physics(void) {
  const ksl_link_mass_t bob = {1.3, {0, 0, -0.7}, {{0}}};
  const double y[3] = {0, 1, 0}, q = 0.8, v = 2.0, a = -1.7, g = 9.81, transmitted = 1.3 * 0.7 * (g * sin(q) + 0.7 * a);
  ksl_joint_options_t pin = ksl_joint_options();
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL, *exact = NULL;
  ksl_data_t *d = NULL;
  double tau = 0, parts[5];
  pin.axis = y, pin.damping = 0.3, pin.friction = 1.5, pin.rotor_inertia = 1e-4, pin.gear_ratio = 50;
  CHECK(ksl_builder_create("p", &b) == KSL_OK && ksl_builder_add_link(b, "ceiling", NULL) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "bob", &bob) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "pin", "continuous", "ceiling", "bob", NULL, &pin) == KSL_OK);
  for (int bodies = 0; bodies < 2; ++bodies) {
    ksl_model_options_t options = ksl_model_options();
    CHECK(!options.physics.damping && !options.physics.rotor);
    options.physics.damping = true, options.physics.rotor = true, options.physics.rotor_bodies = bodies == 1;
    CHECK(ksl_builder_build(b, &options, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
    CHECK(ksl_model_physics(m).damping && !ksl_model_physics(m).spring && ksl_model_physics(m).friction_width == 0.01);
    CHECK(ksl_model_links(m) == 2 + bodies && ksl_model_nv(m) == 1);
    CHECK(ksl_inverse_dynamics(m, d, &q, &v, &a, NULL, &tau) == KSL_OK);
    CHECK(close_to(tau, transmitted + 0.3 * v + 0.25 * a));
    CHECK(ksl_effort_parts(m, d, &q, &v, &a, NULL, parts) == KSL_OK);
    CHECK(close_to(parts[0], transmitted) && close_to(parts[1], 0.6) && parts[2] == 0 && close_to(parts[3], 0.25 * a) &&
          parts[4] == 0);
    const ksl_physics_t physics = {.exact_friction = true};
    CHECK(ksl_model_with_physics(m, &physics, &exact) == KSL_OK && ksl_model_links(exact) == 2);
    ksl_data_free(d), d = NULL;
    CHECK(ksl_data_create(exact, &d) == KSL_OK);
    CHECK(ksl_inverse_dynamics(exact, d, &q, &v, &a, NULL, &tau) == KSL_OK && close_to(tau, transmitted + 1.5));
    CHECK_REFUSED(ksl_forward_dynamics(exact, d, &q, &v, &a, NULL, &tau), KSL_BAD_ARGUMENT,
                  "exact dry friction jumps at rest");
    ksl_data_free(d), ksl_model_free(exact), ksl_model_free(m);
  }
  ksl_builder_free(b);
}

/* From memory: the same model as from the file, no byte beyond the length read, lines named. */
static void test_memory(const char *path) {
  ksl_model_t *m = NULL, *file = NULL;
  ksl_joint_info_t a, b;
  const size_t n = strlen(pendulum);
  char *text = malloc(n + 4);
  if (!text)
    return;
  memcpy(text, pendulum, n);
  memcpy(text + n, "<no>", 4);
  CHECK(ksl_model_load(path, NULL, &file) == KSL_OK && ksl_model_load_memory(text, n, NULL, &m) == KSL_OK);
  CHECK(ksl_model_links(m) == 3 && ksl_model_joint_info(m, 0, &a) == KSL_OK &&
        ksl_model_joint_info(file, 0, &b) == KSL_OK);
  CHECK(!strcmp(a.kind, "continuous") && a.q_index == 0 && a.nv == 1 && !memcmp(a.axis, b.axis, sizeof a.axis));
  CHECK(ksl_model_mass(m) == 1.3);
  ksl_model_free(m), ksl_model_free(file);
  CHECK_REFUSED(ksl_model_load_memory(text, n + 4, NULL, &m), KSL_BAD_DESCRIPTION, "<string>");
  CHECK(m == NULL);
  CHECK_REFUSED(ksl_model_load_memory("<robot name='r'>\n<link nam='a'/></robot>", 39, NULL, &m), KSL_BAD_DESCRIPTION,
                "<string>:2");
  CHECK_REFUSED(ksl_model_load_memory("", 0, NULL, &m), KSL_BAD_DESCRIPTION, "<string>: the file is empty");
  CHECK_REFUSED(ksl_model_load_memory(NULL, 0, NULL, &m), KSL_BAD_ARGUMENT, "text and model must not be null");
  ksl_model_options_t options = ksl_model_options();
  options.floating_base = true;
  CHECK(ksl_model_load_memory(text, n, &options, &m) == KSL_OK && ksl_model_nv(m) == 7);
  ksl_model_free(m);
  free(text);
}

/* Values that are no enumerators are refused, and nothing is computed. */
static void test_unknown_enumerators(const char *path) {
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  const double x[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  ksl_coscrew_t wrench;
  memcpy(&wrench, x, sizeof wrench);
  const int link = 3, joint = 1, unknown[] = {-1, 4, 7, 1 << 30};
  double out[36];
  for (int i = 0; i < 4; ++i) {
    const int value = unknown[i];
    ksl_section_t section = ksl_section(link);
    section.share = (ksl_section_share_t)value;
    CHECK(ksl_section_wrench(m, d, x, x, x, NULL, &section, out) == KSL_BAD_ARGUMENT);
    section = ksl_section(link), section.axes = (ksl_expressed_t)value;
    CHECK(ksl_section_wrench(m, d, x, x, x, NULL, &section, out) == KSL_BAD_ARGUMENT);
    section = ksl_section(link), section.order = (ksl_order_t)value;
    CHECK(ksl_section_wrench(m, d, x, x, x, NULL, &section, out) == KSL_BAD_ARGUMENT);
    const ksl_external_t external = {1, &link, &wrench, (ksl_expressed_t)value};
    CHECK_REFUSED(ksl_inverse_dynamics(m, d, x, x, x, &external, out), KSL_BAD_ARGUMENT, "axes");
    const ksl_external_rows_t rows = {1, &link, x, 0, (ksl_expressed_t)value};
    CHECK(ksl_inverse_dynamics_external_batch(m, 1, x, 6, x, 6, x, 6, &rows, out, 6, 1) == KSL_BAD_ARGUMENT);
    for (int member = 0; member < 5; ++member) {
      ksl_reaction_options_t how = {0};
      int *const members[] = {(int *)&how.part, (int *)&how.on, (int *)&how.at, (int *)&how.axes, (int *)&how.order};
      memcpy(members[member], &value, sizeof value);
      CHECK_REFUSED(ksl_inverse_dynamics_with_reactions(m, d, x, x, x, NULL, out, 1, &joint, &how, out + 6),
                    KSL_BAD_ARGUMENT, "enumerations");
    }
    for (int member = 0; member < 4; ++member) {
      ksl_frame_options_t how = {0};
      int *const members[] = {(int *)&how.axes, (int *)&how.at, (int *)&how.order, (int *)&how.kind};
      memcpy(members[member], &value, sizeof value);
      CHECK(ksl_frame_velocity(m, d, x, x, link, &how, out) == KSL_BAD_ARGUMENT);
    }
    ksl_builder_t *b = NULL;
    CHECK(ksl_builder_create("arm", &b) == KSL_OK && ksl_builder_add_link(b, "root", NULL) == KSL_OK);
    const ksl_dh_row_t row = {0.1, 0, 0, 0, NULL, {1, {0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
    CHECK_REFUSED(ksl_builder_add_dh_chain(b, "root", 1, &row, (ksl_dh_convention_t)value, NULL), KSL_BAD_ARGUMENT,
                  "convention");
    ksl_builder_free(b);
  }
  ksl_data_free(d);
  ksl_model_free(m);
}

/* What a call would have created is null where it fails, whatever the reason. */
static void test_nothing_created(const char *path) {
  char some; /* anything with an address */
  ksl_model_t *const some_model = (ksl_model_t *)(void *)&some, *m = some_model;
  ksl_data_t *const some_data = (ksl_data_t *)(void *)&some, *d = some_data;
  ksl_builder_t *b = (ksl_builder_t *)(void *)&some;
  CHECK(ksl_data_create(NULL, &d) == KSL_BAD_ARGUMENT && !d);
  CHECK(ksl_model_load(NULL, NULL, &m) == KSL_BAD_ARGUMENT && !m);
  m = some_model;
  CHECK(ksl_model_load("missing.urdf", NULL, &m) == KSL_BAD_DESCRIPTION && !m);
  m = some_model;
  CHECK(ksl_model_load_memory(NULL, 0, NULL, &m) == KSL_BAD_ARGUMENT && !m);
  m = some_model;
  CHECK(ksl_builder_build(NULL, NULL, &m) == KSL_BAD_ARGUMENT && !m);
  m = some_model;
  CHECK(ksl_model_subtree(NULL, 0, &m) == KSL_BAD_ARGUMENT && !m);
  CHECK(ksl_builder_create(NULL, &b) == KSL_BAD_ARGUMENT && !b);
  CHECK(ksl_model_load(path, NULL, NULL) == KSL_BAD_ARGUMENT);
}

/* Numbers of states, links and threads that nothing can hold are refused, and nothing is read or written. */
static void test_sizes(const char *path) {
  ksl_model_t *m = NULL;
  CHECK(ksl_model_load(path, NULL, &m) == KSL_OK);
  const double x[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const float xf[6] = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f};
  const int link = 3, joint = 1;
  double out[36] = {-7}, wrench[6] = {-7};
  float outf[36] = {-7};
  const size_t beyond[] = {SIZE_MAX,     SIZE_MAX - 1,  SIZE_MAX / 2,
                           SIZE_MAX / 8, SIZE_MAX / 64, (size_t)PTRDIFF_MAX / 48 + 2};
  for (size_t i = 0; i < sizeof beyond / sizeof *beyond; ++i)
    for (int threads = 0; threads < 3; ++threads) {
      const size_t n = beyond[i];
      CHECK_REFUSED(ksl_inverse_dynamics_batch(m, n, x, 6, x, 6, x, 6, out, 6, threads), KSL_BAD_ARGUMENT, "memory");
      CHECK_REFUSED(ksl_inverse_dynamics_batch(m, n, x, 0, x, 0, x, 0, out, -6, threads), KSL_BAD_ARGUMENT, "memory");
      CHECK_REFUSED(ksl_mass_matrix_batch(m, n, x, 6, out, 36, threads), KSL_BAD_ARGUMENT, "memory");
      CHECK_REFUSED(ksl_inverse_dynamics_with_reactions_batch(m, n, x, 0, x, 0, x, 0, out, 6, 1, &joint, NULL, wrench,
                                                              6, threads),
                    KSL_BAD_ARGUMENT, "memory");
      const ksl_external_rows_t rows = {1, &link, x, 6, KSL_IN_FRAME};
      CHECK_REFUSED(ksl_inverse_dynamics_external_batch(m, n, x, 0, x, 0, x, 0, &rows, out, 6, threads),
                    KSL_BAD_ARGUMENT, "memory");
      const ksl_wanted_frame_t frame = {link, 1, 1};
      CHECK_REFUSED(
          ksl_inverse_kinematics(m, n, 1, &frame, x, 16, NULL, 0, NULL, out, 6, NULL, 0, NULL, NULL, NULL, threads),
          KSL_BAD_ARGUMENT, "memory");
      if (n > (size_t)PTRDIFF_MAX / 24 + 2)
        CHECK_REFUSED(ksl_inverse_dynamics_batchf(m, n, xf, 6, xf, 6, xf, 6, outf, 6, threads), KSL_BAD_ARGUMENT,
                      "memory");
    }
  CHECK_REFUSED(ksl_inverse_dynamics_batch(m, 1, x, 6, x, 6, x, 6, out, 6, -1), KSL_BAD_ARGUMENT, "threads");
  const ksl_external_rows_t many = {1 << 30, &link, x, 6, KSL_IN_FRAME};
  CHECK_REFUSED(ksl_inverse_dynamics_external_batch(m, 1, x, 6, x, 6, x, 6, &many, out, 6, 1), KSL_BAD_ARGUMENT,
                "2^24");
  CHECK_REFUSED(ksl_frame_poses_batch(m, 1, x, 6, 1 << 30, &link, out, 6, 1), KSL_BAD_ARGUMENT, "2^24");
  CHECK(out[0] == -7 && outf[0] == -7);
  CHECK(ksl_inverse_dynamics_batch(m, 0, NULL, 0, NULL, 0, NULL, 0, NULL, 0, 0) == KSL_OK);
  ksl_model_free(m);
}

/* The layout of the mass matrix of a robot with a mimic joint is not that of its tree. */
static void test_tree_of_followers(void) {
  static const char robot[] =
      "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial></link><link name='c'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
      "<joint name='k' type='continuous'><parent link='b'/><child link='c'/><mimic joint='j'/></joint></robot>";
  ksl_model_t *m = NULL;
  CHECK(ksl_model_load_memory(robot, strlen(robot), NULL, &m) == KSL_OK && ksl_model_nv(m) == 1);
  int rows[3] = {-7, -7, -7};
  CHECK_REFUSED(ksl_model_tree(m, rows, NULL), KSL_BAD_ARGUMENT,
                "mimic"); /* rows has nv + 1 numbers; there would be one more */
  CHECK(rows[0] == -7 && rows[2] == -7);
  ksl_model_free(m);
}

int main(int argc, char **argv) {
  if (argc != 3)
    return 1;
  char path[4096], sample[4096];
  snprintf(path, sizeof path, "%s/pendulum.urdf", argv[2]);
  snprintf(sample, sizeof sample, "%s/ur5.urdf", argv[1]);
  if (getenv("KSL_ISA") && !strcmp(getenv("KSL_ISA"), "nonsense")) {
    test_unknown_instruction_set(sample);
    return exit_status();
  }
  FILE *f = fopen(path, "w");
  if (!f)
    return 1;
  fputs(pendulum, f);
  fclose(f);
  test_pendulum(path);
  test_memory(path);
  test_options(path);
  test_payload(path);
  test_masses(argv[2]);
  test_sdf(argv[2]);
  test_files(argv[2], path);
  test_sample_robot(sample);
  test_dynamics(sample);
  test_positions_and_energies(sample);
  test_physics();
  test_unknown_enumerators(sample);
  test_nothing_created(path);
  test_sizes(sample);
  test_tree_of_followers();
  return exit_status();
}
