/* Arguments of the C interface: what is wrong is refused in a sentence with its status, and what is absent gives nothing.  Single
   precision gives the numbers of double precision, rounded. */
#include "c_checks.h"

#include <ksl/engine.h>
#include <ksl/ksl.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The call is refused as a bad argument, in one line that has the words. */
#define CHECK_BAD(call, words) CHECK_REFUSED(call, KSL_BAD_ARGUMENT, words)

#define INERTIAL                                                                                                       \
  "<inertial><origin xyz='0 0 -0.7'/><mass value='1.3'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial>"
/* Two pendulums, the second of which follows the first, and a socket. */
static const char robot[] =
    "<robot name='r'><link name='ceiling'/><link name='bob'>" INERTIAL "</link><link name='shadow'>" INERTIAL
    "</link><link name='ball'>" INERTIAL
    "</link><joint name='pin' type='continuous'><parent link='ceiling'/><child link='bob'/><axis xyz='0 1 0'/></joint>"
    "<joint name='second' type='continuous'><parent link='ceiling'/><child link='shadow'/><axis xyz='0 1 0'/>"
    "<mimic joint='pin' multiplier='-2' offset='0.25'/></joint>"
    "<joint name='socket' type='spherical'><parent link='bob'/><child link='ball'/></joint><transmission name='t'/></robot>";

static ksl_model_t *model_of(const char *text, const ksl_model_options_t *options) {
  ksl_model_t *m = NULL;
  CHECK(ksl_model_load_memory(text, strlen(text), options, &m) == KSL_OK);
  return m;
}

static void test_nothing_of_nothing(const ksl_model_t *m) {
  CHECK(ksl_model_nq(NULL) == 0 && ksl_model_nv(NULL) == 0 && ksl_model_moving_joints(NULL) == 0);
  CHECK(ksl_model_joints(NULL) == 0 && ksl_model_links(NULL) == 0 && ksl_model_tree_elements(NULL) == 0 &&
        ksl_model_mass(NULL) == 0);
  CHECK(ksl_model_warning(NULL, 0) == NULL && ksl_model_unused(NULL, 0) == NULL && ksl_model_link(NULL, "bob") == -1);
  CHECK(!ksl_model_physics(NULL).damping && ksl_model_physics(NULL).friction_width == 0);
  CHECK(strstr(ksl_model_unused(m, 0), "transmission") && ksl_model_unused(m, -1) == NULL &&
        ksl_model_unused(m, 99) == NULL);
  double multiplier = 7, offset = 7;
  CHECK(ksl_model_joint(m, "nobody") == -1 && ksl_model_joint(m, NULL) == -1 &&
        strstr(ksl_error_message(), "must not be null"));
  CHECK(ksl_model_link(m, "nobody") == -1 && ksl_model_link(NULL, "x") == -1 &&
        strstr(ksl_error_message(), "must not be null"));
  CHECK(ksl_model_leader(m, ksl_model_joint(m, "second"), &multiplier, &offset) == ksl_model_joint(m, "pin"));
  CHECK(multiplier == -2 && offset == 0.25);
  for (int out = -1; out < 100; out += 100) {
    CHECK(ksl_model_leader(m, out, NULL, NULL) == -1 && ksl_model_joint_above(m, out) == -1 &&
          ksl_model_parent_link(m, out) == -1);
    CHECK(ksl_model_support(m, out, NULL) == -1 && ksl_model_subtree_links(m, out, NULL) == -1 &&
          ksl_model_subtree_mass(m, out) == 0);
  }
  CHECK(ksl_model_leader(m, 99, NULL, NULL) == -1);
  CHECK(ksl_model_subtree_mass(m, ksl_model_joint(m, "pin")) == 2.6);
}

static void test_queries(const ksl_model_t *m) {
  ksl_joint_info_t info;
  double parameters[10];
  CHECK_BAD(ksl_model_joint_info(NULL, 0, &info), "must not be null");
  CHECK_BAD(ksl_model_joint_info(m, 0, NULL), "must not be null");
  CHECK_BAD(ksl_model_joint_info(m, -1, &info), "a joint is out of range: joint is -1; expected 0 to ");
  CHECK_BAD(ksl_model_joint_info(m, ksl_model_joints(m), &info), "a joint is out of range");
  CHECK_BAD(ksl_model_link_parameters(NULL, 0, parameters), "must not be null");
  CHECK_BAD(ksl_model_link_parameters(m, 0, NULL), "must not be null");
  CHECK_BAD(ksl_model_link_parameters(m, -1, parameters), "a link is out of range: link is -1; expected 0 to ");
  CHECK(ksl_model_link_parameters(m, ksl_model_link(m, "bob"), parameters) == KSL_OK && parameters[0] == 1.3);
  CHECK_BAD(ksl_model_tree(NULL, NULL, NULL), "must not be null");
  CHECK_BAD(ksl_model_tree(m, NULL, NULL), "load it with mimic_independent");
  ksl_model_options_t options = ksl_model_options();
  options.mimic_independent = true;
  ksl_model_t *const independent = model_of(robot, &options);
  CHECK(ksl_model_tree(independent, NULL, NULL) == KSL_OK); /* neither is wanted */
  ksl_model_free(independent);
}

/* Positions: neutral ones, and those that numbers from 0 to 1 choose. */
static void test_positions(const ksl_model_t *m) {
  double q[5], uniform[5] = {0.1, 0.2, 0.3, 0.4, 0.5};
  float qf[5], uniformf[5] = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f};
  CHECK(ksl_model_nq(m) == 5);
  CHECK(ksl_neutral(m, q) == KSL_OK && q[0] == 0 && q[1] == 0 && q[4] == 1);
  CHECK(ksl_neutralf(m, qf) == KSL_OK && qf[0] == 0 && qf[1] == 0 && qf[4] == 1);
  CHECK_BAD(ksl_neutral(NULL, q), "must not be null");
  CHECK_BAD(ksl_neutral(m, NULL), "must not be null");
  CHECK(ksl_random_position(m, uniform, q) == KSL_OK && ksl_random_positionf(m, uniformf, qf) == KSL_OK);
  CHECK(fabs(q[1] * q[1] + q[2] * q[2] + q[3] * q[3] + q[4] * q[4] - 1) < 1e-15);
  for (int i = 0; i < 5; ++i)
    CHECK(fabs(q[i] - (double)qf[i]) < 1e-6);
  CHECK_BAD(ksl_random_position(NULL, uniform, q), "must not be null");
  CHECK_BAD(ksl_random_position(m, uniform, NULL), "must not be null");
  uniform[2] = 1;
  CHECK_BAD(ksl_random_position(m, uniform, q), "from 0 to below 1");
  uniform[2] = -0.1;
  CHECK_BAD(ksl_random_position(m, uniform, q), "from 0 to below 1");
}

static void test_reactions(const ksl_model_t *m, ksl_data_t *d) {
  const double q[5] = {0.8, 0, 0, 0, 1}, v[4] = {1, 2, 3, 4}, a[4] = {4, 3, 2, 1};
  const float qf[5] = {0.8f, 0, 0, 0, 1}, vf[4] = {1, 2, 3, 4}, af[4] = {4, 3, 2, 1};
  double tau[4], w[6];
  float tauf[4], wf[6];
  const int pin = ksl_model_joint(m, "pin"), nobody = ksl_model_joints(m), below = -1;
  CHECK_BAD(ksl_reactions(m, d, 1, &pin, NULL, NULL, w), "call that first");
  CHECK(ksl_inverse_dynamics(m, d, q, v, a, NULL, tau) == KSL_OK &&
        ksl_reactions(m, d, 1, &pin, NULL, NULL, w) == KSL_OK);
  CHECK_BAD(ksl_reactionsf(m, d, 1, &pin, NULL, NULL, wf), "in the same precision");
  CHECK_BAD(ksl_reactions(m, d, 1, &pin, NULL, NULL, NULL), "wrenches must not be null");
  CHECK_BAD(ksl_reactions(m, d, 1, NULL, NULL, NULL, w), "n must be between 0");
  CHECK_BAD(ksl_reactions(m, d, -1, &pin, NULL, NULL, w), "n must be between 0");
  CHECK_BAD(ksl_reactions(m, d, nobody + 1, &pin, NULL, NULL, w), "n must be between 0");
  CHECK_BAD(ksl_reactions(m, d, 1, &nobody, NULL, NULL, w), "a joint is out of range: joints[0] is ");
  CHECK_BAD(ksl_reactions(m, d, 1, &below, NULL, NULL, w), "a joint is out of range");
  ksl_reaction_options_t how = {0};
  how.at = how.axes = KSL_LINK;
  how.at_link = 1, how.axes_link = -1;
  CHECK_BAD(ksl_reactions(m, d, 1, &pin, &how, NULL, w), "at_link or axes_link is out of range");
  how.at_link = ksl_model_links(m), how.axes_link = 1;
  CHECK_BAD(ksl_reactions(m, d, 1, &pin, &how, NULL, w), "at_link or axes_link is out of range");
  CHECK(ksl_inverse_dynamicsf(m, d, qf, vf, af, NULL, tauf) == KSL_OK &&
        ksl_reactionsf(m, d, 1, &pin, NULL, NULL, wf) == KSL_OK);
  for (int i = 0; i < 6; ++i)
    CHECK(fabs(w[i] - (double)wf[i]) < 1e-4 * (1 + fabs(w[i])));
  CHECK(ksl_reactionsf(m, d, 0, NULL, NULL, NULL, NULL) == KSL_OK); /* none */

  /* a batch has the bits of each state, with wrenches that push and without */
  double batch[6], pushed[6];
  float batchf[6], pushedf[6];
  const int bob = ksl_model_link(m, "bob");
  const ksl_coscrew_t push = {{{1, 2, 3, 4, 5, 6}}};
  const ksl_coscrewf_t pushf = {{{1, 2, 3, 4, 5, 6}}};
  const ksl_external_t external = {1, &bob, &push, KSL_IN_FRAME};
  const ksl_externalf_t externalf = {1, &bob, &pushf, KSL_IN_FRAME};
  const ksl_external_rows_t rows = {1, &bob, push.at, 6, KSL_IN_FRAME};
  const ksl_external_rowsf_t rowsf = {1, &bob, pushf.at, 6, KSL_IN_FRAME};
  CHECK(ksl_reactions_batch(m, 1, q, 5, v, 4, a, 4, 1, &pin, NULL, batch, 6, 1) == KSL_OK &&
        memcmp(batch, w, sizeof w) == 0);
  CHECK(ksl_reactions_batchf(m, 1, qf, 5, vf, 4, af, 4, 1, &pin, NULL, batchf, 6, 1) == KSL_OK &&
        memcmp(batchf, wf, sizeof wf) == 0);
  CHECK(ksl_inverse_dynamics(m, d, q, v, a, &external, tau) == KSL_OK &&
        ksl_reactions(m, d, 1, &pin, NULL, &external, w) == KSL_OK);
  CHECK(ksl_inverse_dynamicsf(m, d, qf, vf, af, &externalf, tauf) == KSL_OK &&
        ksl_reactionsf(m, d, 1, &pin, NULL, &externalf, wf) == KSL_OK);
  CHECK(ksl_reactions_external_batch(m, 1, q, 5, v, 4, a, 4, &rows, 1, &pin, NULL, pushed, 6, 1) == KSL_OK &&
        memcmp(pushed, w, sizeof w) == 0);
  CHECK(ksl_reactions_external_batchf(m, 1, qf, 5, vf, 4, af, 4, &rowsf, 1, &pin, NULL, pushedf, 6, 1) == KSL_OK &&
        memcmp(pushedf, wf, sizeof wf) == 0);
  CHECK(memcmp(pushed, batch, sizeof batch) != 0);
}

static void test_external(const ksl_model_t *m, ksl_data_t *d) {
  const double q[5] = {0.8, 0, 0, 0, 1}, zero[4] = {0};
  double tau[4];
  const int bob = ksl_model_link(m, "bob"), nobody = ksl_model_links(m), below = -1;
  const ksl_coscrew_t push = {{{1, 2, 3, 4, 5, 6}}};
  ksl_external_t external = {1, NULL, &push, KSL_IN_FRAME};
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau), "external needs n links and n wrenches");
  external.link = &bob, external.wrench = NULL;
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau), "external needs n links and n wrenches");
  external.wrench = &push, external.n = -1;
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau), "external needs n links and n wrenches");
  external.n = 1, external.link = &nobody;
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau), "external names a link out of range");
  external.link = &below;
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau), "external names a link out of range");
  external.n = 0;
  double alone[4];
  CHECK(ksl_inverse_dynamics(m, d, q, zero, zero, &external, tau) == KSL_OK &&
        ksl_inverse_dynamics(m, d, q, zero, zero, NULL, alone) == KSL_OK);
  CHECK(memcmp(tau, alone, sizeof tau) == 0);
  CHECK_BAD(ksl_inverse_dynamics(m, d, NULL, zero, zero, NULL, tau), "must not be null");
  CHECK_BAD(ksl_inverse_dynamics(m, d, q, NULL, zero, NULL, tau), "must not be null");
}

/* A section of bob above its centre of mass carries what hangs below: the wrench is that of the pin, less nothing. */
static void test_sections(const ksl_model_t *m, ksl_data_t *d) {
  const double q[5] = {0.8, 0, 0, 0, 1}, zero[4] = {0};
  const float qf[5] = {0.8f, 0, 0, 0, 1}, zerof[4] = {0};
  double w[6], reaction[6], tau[4];
  float wf[6];
  const int pin = ksl_model_joint(m, "pin"), second = ksl_model_joint(m, "second"), nobody = ksl_model_joints(m),
            below = -1;
  ksl_section_t s = ksl_section(ksl_model_link(m, "bob"));
  s.normal[2] = -1;
  CHECK(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w) == KSL_OK &&
        ksl_section_wrenchf(m, d, qf, zerof, zerof, NULL, &s, wf) == KSL_OK);
  CHECK(ksl_inverse_dynamics(m, d, q, zero, zero, NULL, tau) == KSL_OK &&
        ksl_reactions(m, d, 1, &pin, NULL, NULL, reaction) == KSL_OK);
  for (int i = 0; i < 6; ++i)
    CHECK(fabs(fabs(w[i]) - fabs(reaction[i])) < 1e-12 * (1 + fabs(w[i])) &&
          fabs(w[i] - (double)wf[i]) < 1e-4 * (1 + fabs(w[i])));
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, NULL), "wrench must not be null");
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, NULL, w), "section must not be null");
  s.normal[2] = 0;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "normal is zero");
  s.normal[1] = 1; /* in the plane of the centre: any direction is one */
  CHECK(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w) == KSL_OK);
  s.normal[0] = 1, s.normal[1] = 0;
  CHECK(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w) == KSL_OK);
  s.share = KSL_FRACTION, s.fraction = 1.5;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "fraction must be between 0 and 1");
  s.fraction = -0.5;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "fraction must be between 0 and 1");
  s.fraction = 0.5, s.beyond_n = 1;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "beyond must not be null");
  s.beyond = &nobody;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "beyond names a joint out of range");
  s.beyond = &below;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w), "beyond names a joint out of range");
  s.beyond = &second;
  CHECK_BAD(ksl_section_wrench(m, d, q, zero, zero, NULL, &s, w),
            "beyond names second, which neither carries bob nor is carried by it");
}

/* The hand of a pendulum that hangs at an angle is where that angle is found again. */
static void test_inverse_kinematics(const ksl_model_t *m) {
  enum { n = 2 };
  ksl_data_t *d = NULL;
  ksl_wanted_frame_t frame = {ksl_model_link(m, "bob"), 1, 1};
  double target[n][16], q[n][5], error[n][2], start[n][5] = {{0.3, 0, 0, 0, 1}, {-0.3, 0, 0, 0, 1}};
  float targetf[n][16], qf[n][5];
  int ends[n], iterations[n], starts[n];
  CHECK(ksl_data_create(m, &d) == KSL_OK);
  for (int k = 0; k < n; ++k) {
    const double at[5] = {k ? -0.5 : 0.5, 0, 0, 0, 1};
    CHECK(ksl_frame_poses(m, d, at, 1, &frame.link, target[k]) == KSL_OK);
    for (int i = 0; i < 16; ++i)
      targetf[k][i] = (float)target[k][i];
  }
  CHECK(ksl_inverse_kinematics(m, n, 1, &frame, target[0], 16, start[0], 5, NULL, q[0], 5, error[0], 2, ends,
                               iterations, starts, 1) == KSL_OK);
  for (int k = 0; k < n; ++k)
    CHECK(fabs(q[k][0] - (k ? -0.5 : 0.5)) < 1e-5 && q[k][4] == 1 && error[k][0] <= 1e-6 && error[k][1] <= 1e-6 &&
          ends[k] == KSL_CONVERGED && iterations[k] > 0 && starts[k] == 1);
  double alone[n][5];
  CHECK(ksl_inverse_kinematics(m, n, 1, &frame, target[0], 16, start[0], 5, NULL, alone[0], 5, NULL, 0, NULL, NULL,
                               NULL, 1) == KSL_OK);
  CHECK(memcmp(alone, q, sizeof q) == 0); /* what is not wanted changes nothing */
  ksl_inverse_kinematics_options_t options = ksl_inverse_kinematics_options();
  options.position_tolerance = options.orientation_tolerance = 1e-4;
  CHECK(ksl_inverse_kinematicsf(m, n, 1, &frame, targetf[0], 16, NULL, 0, &options, qf[0], 5, NULL, 0, NULL, NULL, NULL,
                                1) == KSL_OK);
  for (int k = 0; k < n; ++k)
    CHECK(fabs(remainder((double)qf[k][0] - (k ? -0.5 : 0.5), 6.283185307179586)) < 1e-3);
  CHECK(ksl_inverse_kinematics(m, 0, 1, &frame, NULL, 16, NULL, 0, NULL, NULL, 5, NULL, 0, NULL, NULL, NULL, 1) ==
        KSL_OK);
  /* Rows that are not there, and rows of no states, may be as far apart as can be. */
  CHECK(ksl_inverse_kinematics(m, 0, 1, &frame, target[0], PTRDIFF_MAX, NULL, PTRDIFF_MIN, NULL, q[0], PTRDIFF_MAX,
                               NULL, 0, NULL, NULL, NULL, 1) == KSL_OK);
  CHECK(ksl_inverse_kinematics(m, 1, 1, &frame, target[0], 16, NULL, PTRDIFF_MAX, NULL, alone[0], 5, NULL, PTRDIFF_MIN,
                               NULL, NULL, NULL, 1) == KSL_OK);

  const ksl_inverse_kinematics_options_t usual = ksl_inverse_kinematics_options();
#define SOLVE(model, frames_n, frames, targets, options, q)                                                            \
  ksl_inverse_kinematics(model, n, frames_n, frames, targets, 16, start[0], 5, options, q, 5, NULL, 0, NULL, NULL,     \
                         NULL, 1)
  CHECK_BAD(SOLVE(NULL, 1, &frame, target[0], NULL, q[0]), "model and frames must not be null");
  CHECK_BAD(SOLVE(m, 0, &frame, target[0], NULL, q[0]), "there must be a frame");
  CHECK_BAD(SOLVE(m, 1, NULL, target[0], NULL, q[0]), "model and frames must not be null");
  CHECK_BAD(SOLVE(m, 1, &frame, NULL, NULL, q[0]), "targets and q must not be null");
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], NULL, NULL), "targets and q must not be null");
  options = usual, options.position_tolerance = 0;
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], &options, q[0]), "tolerances must be positive");
  options = usual, options.orientation_tolerance = NAN;
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], &options, q[0]), "tolerances must be positive");
  options = usual, options.iterations = 0;
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], &options, q[0]), "iterations and starts must be positive");
  options = usual, options.starts = 0;
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], &options, q[0]), "iterations and starts must be positive");
  ksl_wanted_frame_t wrong = {frame.link, -1, 1};
  CHECK_BAD(SOLVE(m, 1, &wrong, target[0], NULL, q[0]), "weights must not be negative");
  wrong.position_weight = 1, wrong.orientation_weight = -1;
  CHECK_BAD(SOLVE(m, 1, &wrong, target[0], NULL, q[0]), "weights must not be negative");
  wrong.link = ksl_model_links(m);
  CHECK_BAD(SOLVE(m, 1, &wrong, target[0], NULL, q[0]), "a link is out of range");
  /* no pose: each number of the last row, each of the position, a rotation that is not one, a reflection */
  for (int i = 0; i < 9; ++i) {
    static const int place[9] = {12, 13, 14, 15, 3, 7, 11, 0, 0};
    static const double value[9] = {1, 1, 1, 2, NAN, NAN, NAN, 1.5, -1};
    double kept[n][16];
    memcpy(kept, target, sizeof kept);
    if (i == 8)
      for (int r = 0; r < 3; ++r)
        target[1][4 * r] = -target[1][4 * r];
    else
      target[1][place[i]] = value[i];
    CHECK_BAD(SOLVE(m, 1, &frame, target[0], NULL, q[0]), "a target is not a pose");
    memcpy(target, kept, sizeof kept);
  }
  start[1][4] = 2;
  CHECK_BAD(SOLVE(m, 1, &frame, target[0], NULL, q[0]), "start: the quaternion");
#undef SOLVE
  ksl_data_free(d);
}

static void test_frames(const ksl_model_t *m, ksl_data_t *d) {
  const double q[5] = {0.8, 0, 0, 0, 1}, v[4] = {1, 0, 0, 0};
  double twist[6];
  const ksl_frame_options_t right = {KSL_IN_FRAME, KSL_IN_FRAME, KSL_LINEAR_FIRST, KSL_SPATIAL, {0, 0, 0}};
  ksl_frame_options_t how = right;
  const int bob = ksl_model_link(m, "bob");
  CHECK(ksl_frame_velocity(m, d, q, v, bob, &how, twist) == KSL_OK && fabs(twist[4] - 1) < 1e-15);
  how.offset[1] = NAN;
  CHECK_BAD(ksl_frame_velocity(m, d, q, v, bob, &how, twist), "offset[1] is not a finite number");
  CHECK_BAD(ksl_frame_velocity(m, d, q, v, ksl_model_links(m), NULL, twist), "a link is out of range");
  CHECK_BAD(ksl_frame_velocity(m, d, q, v, -1, NULL, twist), "a link is out of range");
  int all[99] = {0};
  double matrix[99], rank;
  CHECK_BAD(ksl_operational_space_inertia(m, d, q, 99, all, NULL, matrix, &rank),
            "links: at most as many as the model has");
  CHECK_BAD(ksl_operational_space_inertia_batch(m, 1, q, 5, 99, all, NULL, matrix, 99, &rank, 1, 1),
            "links: at most as many as the model has");
}

static void test_options(void) {
  ksl_model_options_t options = ksl_model_options();
  ksl_model_t *m = NULL;
  const size_t length = strlen(robot);
  CHECK_BAD(ksl_model_load_memory(robot, length, NULL, NULL), "text and model must not be null");
  options.physics.friction_width = -1;
  CHECK_BAD(ksl_model_load_memory(robot, length, &options, &m), "friction_width must be a speed");
  options.physics.friction_width = HUGE_VAL;
  CHECK_BAD(ksl_model_load_memory(robot, length, &options, &m), "friction_width must be a speed");
  options.physics.friction_width = 0.25, options.physics.friction = true;
  m = model_of(robot, &options);
  CHECK(ksl_model_physics(m).friction && ksl_model_physics(m).friction_width == 0.25);
  ksl_model_free(m);
  options.payloads_n = -1;
  CHECK_BAD(ksl_model_load_memory(robot, length, &options, &m), "payloads_n must say how many");
  const ksl_payload_t nowhere = {NULL, 1, {0, 0, 0}};
  options.payloads_n = 1, options.payloads = &nowhere;
  CHECK_BAD(ksl_model_load_memory(robot, length, &options, &m), "a payload names no link");
}

/* More numbers than an int counts are refused, before anything is written. */
static void test_numbers_beyond_int(void) {
  enum { joints = 22, links = 1 << 24 }; /* 6 × 22 × 2^24 > 2^31 */
  const ksl_dh_row_t link = {1, 0, 0, 0, NULL, {1, {0}, {{0}}}};
  ksl_dh_row_t rows[joints];
  for (int i = 0; i < joints; ++i)
    rows[i] = link;
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  CHECK(ksl_builder_create("arm", &b) == KSL_OK && ksl_builder_add_link(b, "base", NULL) == KSL_OK);
  CHECK(ksl_builder_add_dh_chain(b, "base", joints, rows, KSL_DH_STANDARD, NULL) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  const double x[joints] = {0};
  double by_q = -7, by_v = -7;
  int *const ground = calloc(links, sizeof *ground);
  if (ground) {
    CHECK_BAD(ksl_frame_velocities_derivatives(m, d, x, x, links, ground, NULL, &by_q, &by_v),
              "by_q would have more than 2^31 - 1 numbers");
    CHECK_BAD(
        ksl_frame_velocities_derivatives_batch(m, 1, x, joints, x, joints, links, ground, NULL, &by_q, 0, &by_v, 0, 1),
        "by_q would have more than 2^31 - 1 numbers");
  }
  CHECK(by_q == -7 && by_v == -7);
  free(ground);
  ksl_model_t *none = m; /* more bytes than a text can have */
  CHECK(ksl_model_load_memory("x", SIZE_MAX, NULL, &none) == KSL_BAD_DESCRIPTION && none == NULL &&
        strstr(ksl_error_message(), "bytes, more than 64 MiB"));
  ksl_data_free(d);
  ksl_model_free(m);
  ksl_builder_free(b);
}

/* What solves with the mass matrix is refused where a joint moves no mass. */
static void test_massless(void) {
  static const char light[] = "<robot name='l'><link name='a'/><link name='b'>" INERTIAL "</link><link name='c'/>"
                              "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
                              "<joint name='k' type='continuous'><parent link='b'/><child link='c'/></joint></robot>";
  ksl_model_t *m = model_of(light, NULL);
  ksl_data_t *d = NULL;
  const double zero[2] = {0};
  double out[2];
  CHECK(ksl_data_create(m, &d) == KSL_OK && ksl_inverse_dynamics(m, d, zero, zero, zero, NULL, out) == KSL_OK);
  CHECK_BAD(ksl_forward_dynamics(m, d, zero, zero, zero, NULL, out),
            "forward_dynamics: joint k can move without moving any mass");
  CHECK_BAD(ksl_forward_dynamics_batch(m, 1, zero, 2, zero, 2, zero, 2, out, 2, 1),
            "joint k can move without moving any mass");
  ksl_data_free(d), ksl_model_free(m);
}

static void test_builders(const char *folder) {
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL, *made = (ksl_model_t *)&failures;
  const double axis[3] = {0, 1, 0};
  ksl_joint_options_t hinge = ksl_joint_options();
  const ksl_link_mass_t bob = {2, {0, 0, -0.5}, {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}};
  const ksl_dh_row_t row = {0.1, 0, 0.2, 0, NULL, bob};
  hinge.axis = axis;
  CHECK_BAD(ksl_builder_create(NULL, &b), "must not be null");
  CHECK_BAD(ksl_builder_create("r", NULL), "must not be null");
  CHECK(ksl_builder_create("r", &b) == KSL_OK && ksl_builder_add_link(b, "ground", NULL) == KSL_OK &&
        ksl_builder_add_link(b, "rod", &bob) == KSL_OK);
  CHECK_BAD(ksl_builder_add_link(NULL, "x", NULL), "must not be null");
  CHECK_BAD(ksl_builder_add_link(b, NULL, NULL), "must not be null");
  CHECK_BAD(ksl_builder_add_joint(NULL, "j", "revolute", "ground", "rod", NULL, &hinge), "must not be null");
  CHECK_BAD(ksl_builder_add_joint(b, NULL, "revolute", "ground", "rod", NULL, &hinge), "must not be null");
  CHECK_BAD(ksl_builder_add_joint(b, "j", NULL, "ground", "rod", NULL, &hinge), "must not be null");
  CHECK_BAD(ksl_builder_add_joint(b, "j", "revolute", NULL, "rod", NULL, &hinge), "must not be null");
  CHECK_BAD(ksl_builder_add_joint(b, "j", "revolute", "ground", NULL, NULL, &hinge), "must not be null");
  CHECK(ksl_builder_add_joint(b, "j", "revolute", "ground", "rod", NULL, &hinge) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "rod2", &bob) == KSL_OK);
  hinge.mimics = "j", hinge.multiplier = 3, hinge.offset = 0.5;
  CHECK(ksl_builder_add_joint(b, "k", "revolute", "rod", "rod2", NULL, &hinge) == KSL_OK);
  CHECK_BAD(ksl_builder_add_dh_chain(NULL, "rod", 1, &row, KSL_DH_STANDARD, NULL), "null");
  CHECK_BAD(ksl_builder_add_dh_chain(b, NULL, 1, &row, KSL_DH_STANDARD, NULL), "null");
  CHECK_BAD(ksl_builder_add_dh_chain(b, "rod", -1, &row, KSL_DH_STANDARD, NULL), "negative");
  CHECK_BAD(ksl_builder_add_dh_chain(b, "rod", 1, NULL, KSL_DH_STANDARD, NULL), "null");
  CHECK(ksl_builder_add_dh_chain(b, "rod", 0, NULL, KSL_DH_STANDARD, NULL) == KSL_OK);
  CHECK(ksl_builder_add_dh_chain(b, "rod", 1, &row, KSL_DH_MODIFIED, "arm_") == KSL_OK);
  CHECK_BAD(ksl_builder_build(b, NULL, NULL), "must not be null");
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK && ksl_model_nv(m) == 2);
  double multiplier, offset;
  CHECK(ksl_model_leader(m, ksl_model_joint(m, "k"), &multiplier, &offset) == ksl_model_joint(m, "j") &&
        multiplier == 3 && offset == 0.5);

  const int arm = ksl_model_joint(m, "arm_joint1"), rod = ksl_model_link(m, "rod");
  const double q = 0.3, heavy[10] = {1, 0, 0, 0, 1, 0, 1, 0, 0, 1};
  CHECK_BAD(ksl_model_with_root(NULL, rod, &made), "must not be null");
  CHECK(made == (ksl_model_t *)&failures || made == NULL);
  CHECK_BAD(ksl_model_with_root(m, rod, NULL), "must not be null");
  CHECK_BAD(ksl_model_with_frozen_joints(m, -1, &arm, &q, &made), "not negative");
  CHECK_BAD(ksl_model_with_frozen_joints(m, 1, NULL, &q, &made), "must not be null");
  CHECK_BAD(ksl_model_with_frozen_joints(m, 1, &arm, NULL, &made), "must not be null");
  CHECK(ksl_model_with_frozen_joints(m, 0, NULL, NULL, &made) == KSL_OK && ksl_model_nv(made) == 2);
  ksl_model_free(made);
  CHECK_BAD(ksl_model_with_parameters(m, 1, &rod, NULL, &made), "parameters must not be null");
  CHECK(ksl_model_with_parameters(m, 0, NULL, NULL, &made) == KSL_OK && ksl_model_mass(made) == ksl_model_mass(m));
  ksl_model_free(made);
  CHECK(ksl_model_with_parameters(m, 1, &rod, heavy, &made) == KSL_OK && ksl_model_mass(made) == ksl_model_mass(m) - 1);
  ksl_model_free(made);
  CHECK(ksl_model_with_physics(m, NULL, &made) == KSL_OK && !ksl_model_physics(made).damping);
  ksl_model_free(made);
  CHECK_BAD(ksl_model_write_urdf(NULL, folder), "must not be null");
  CHECK_BAD(ksl_model_write_urdf(m, NULL), "must not be null");
  ksl_model_free(m);
  ksl_builder_free(b);
}

int main(int argc, char **argv) {
  if (argc != 2)
    return 1;
  ksl_model_t *m = model_of(robot, NULL);
  ksl_data_t *d = NULL;
  CHECK(ksl_data_create(m, &d) == KSL_OK);
  if (!m || !d)
    return 1;
  ksl_data_t *none = d;
  CHECK_BAD(ksl_data_create(NULL, &none), "model and data must not be null");
  CHECK(none == NULL); /* what a call that fails would have made */
  CHECK_BAD(ksl_data_create(m, NULL), "model and data must not be null");
  test_nothing_of_nothing(m);
  test_queries(m);
  test_positions(m);
  test_reactions(m, d);
  test_external(m, d);
  test_sections(m, d);
  test_inverse_kinematics(m);
  test_frames(m, d);
  test_options();
  test_massless();
  test_numbers_beyond_int();
  test_builders(argv[1]);
  ksl_data_free(d);
  ksl_model_free(m);
  return exit_status();
}
