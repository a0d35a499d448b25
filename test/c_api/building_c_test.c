/* Models that a C program describes, and models made from them.  Argument: a folder to write in.  Returns 1 if a check
   fails, otherwise 0. */
#include "c_checks.h"

#include <ksl/engine.h>
#include <ksl/ksl.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The moment that holds a model with one joint, turned by q, against gravity. */
static double held(const ksl_model_t *m, double q) {
  ksl_data_t *d = NULL;
  double tau = NAN;
  CHECK(ksl_data_create(m, &d) == KSL_OK);
  CHECK(ksl_gravity_torque(m, d, &q, NULL, &tau) == KSL_OK);
  ksl_data_free(d);
  return tau;
}

static const double y[3] = {0, 1, 0};

/* A mass of 2 kg half a metre below a hinge. */
static ksl_model_t *pendulum(void) {
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_link_mass_t bob = {2, {0, 0, -0.5}, {{0}}};
  ksl_joint_options_t hinge = ksl_joint_options();
  hinge.axis = y;
  CHECK(ksl_builder_create("pendulum", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "ceiling", NULL) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "rod", &bob) == KSL_OK);
  CHECK_REFUSED(ksl_builder_add_link(b, "rod", NULL), KSL_BAD_DESCRIPTION, "a second link is named \"rod\"");
  CHECK_REFUSED(ksl_builder_add_joint(b, "hinge", "revolute", "ceiling", "rod", NULL, NULL), KSL_BAD_DESCRIPTION,
                "needs an axis");
  CHECK_REFUSED(ksl_builder_add_joint(b, "hinge", "round", "ceiling", "rod", NULL, &hinge), KSL_BAD_DESCRIPTION,
                "\"round\" is unknown");
  CHECK_REFUSED(ksl_builder_build(b, NULL, &m), KSL_BAD_DESCRIPTION, "one root");
  CHECK(m == NULL);
  CHECK(ksl_builder_add_joint(b, "hinge", "revolute", "ceiling", "rod", NULL, &hinge) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK);
  ksl_builder_free(b);
  ksl_model_t *none = m;
  CHECK_REFUSED(ksl_builder_build(NULL, NULL, &none), KSL_BAD_ARGUMENT, "null");
  CHECK(none == NULL);
  return m;
}

/* A rod on a hinge at each end of a beam, whose other end is held by a second hinge: with a drive, and cut. */
static void test_loops(void) {
  const ksl_link_mass_t mass = {1, {0.5, 0, 0}, {{0}}};
  const ksl_SE3_t at_end = ksl_SE3_fromRt(ksl_mat3x3(1, 0, 0, 0, 1, 0, 0, 0, 1), ksl_vec3(1, 0, 0));
  const char *drives[] = {"hinge"};
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL, *cut = NULL, *driven = NULL;
  ksl_joint_options_t hinge = ksl_joint_options();
  ksl_loop_options_t about_y = ksl_loop_options(), screw = ksl_loop_options();
  double held = 1;
  ksl_data_t *d = NULL;
  const double q = 0;
  hinge.axis = about_y.axis = screw.axis = y;
  CHECK(ksl_builder_create("door", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "wall", NULL) == KSL_OK && ksl_builder_add_link(b, "leaf", &mass) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "hinge", "revolute", "wall", "leaf", NULL, &hinge) == KSL_OK);
  CHECK_REFUSED(ksl_builder_add_loop(b, "second", "revolute", "wall", "leaf", NULL, NULL, NULL), KSL_BAD_DESCRIPTION,
                "needs an axis");
  CHECK_REFUSED(ksl_builder_add_loop(b, "second", "helical", "wall", "leaf", NULL, NULL, &screw), KSL_BAD_DESCRIPTION,
                "pitch");
  CHECK_REFUSED(ksl_builder_add_loop(b, "second", "revolute", "wall", "lef", NULL, NULL, &about_y), KSL_BAD_DESCRIPTION,
                "leaf");
  CHECK_REFUSED(ksl_builder_add_loop(b, NULL, "revolute", "wall", "leaf", NULL, NULL, &about_y), KSL_BAD_ARGUMENT,
                "null");
  CHECK_REFUSED(ksl_builder_set_drives(b, 1, NULL), KSL_BAD_ARGUMENT, "null");
  CHECK(ksl_builder_add_loop(b, "second", "spherical", "wall", "leaf", &at_end, &at_end, NULL) == KSL_OK);
  CHECK(ksl_builder_set_drives(b, 1, drives) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK);
  ksl_builder_free(b);
  CHECK(ksl_model_without_loops(m, &cut) == KSL_OK && ksl_model_nv(cut) == 1);
  CHECK(ksl_data_create(cut, &d) == KSL_OK && ksl_gravity_torque(cut, d, &q, NULL, &held) == KSL_OK);
  CHECK(fabs(held + 0.5 * 9.81) < 1e-12);
  ksl_data_free(d);
  const int joint = 0;
  CHECK(ksl_model_with_drives(m, 1, &joint, &driven) == KSL_OK);
  ksl_model_free(driven);
  const double weight = 4, none = 0;
  CHECK(ksl_model_with_weighted_drives(m, 1, &joint, &weight, &driven) == KSL_OK);
  ksl_model_free(driven);
  CHECK_REFUSED(ksl_model_with_weighted_drives(m, 1, &joint, &none, &driven), KSL_BAD_DESCRIPTION, "its weight is 0");
  CHECK_REFUSED(ksl_model_with_drives(cut, 1, &joint, &driven), KSL_BAD_DESCRIPTION, "no loops");
  CHECK_REFUSED(ksl_model_with_drives(m, 1, NULL, &driven), KSL_BAD_ARGUMENT, "null");
  ksl_model_free(cut), ksl_model_free(m);
}

/* A spring from the wall to a leaf that hangs from its hinge: with the leaf at the angle q it is vertical for q = 0, and its length follows from
   the law of cosines. */
static void test_force_elements(void) {
  const ksl_link_mass_t mass = {1, {0.5, 0, 0}, {{0}}};
  const double above[3] = {0, 0, 1}, on_leaf[3] = {0.5, 0, 0}, q = 0.3, v = -0.7;
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  ksl_joint_options_t hinge = ksl_joint_options();
  ksl_force_element_numbers_t numbers = ksl_force_element_numbers();
  ksl_model_options_t options = ksl_model_options();
  double length = 0, rate = 0, tension = 0, without = 0, with = 0;
  hinge.axis = y;
  numbers.stiffness = 200, numbers.free_length = 0.4, numbers.damping = 3, numbers.preload = 5, numbers.upper = 2;
  CHECK(ksl_builder_create("spring", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "wall", NULL) == KSL_OK && ksl_builder_add_link(b, "leaf", &mass) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "hinge", "revolute", "wall", "leaf", NULL, &hinge) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  CHECK(ksl_bias(m, d, &q, &v, NULL, &without) == KSL_OK && ksl_model_force_elements(m) == 0);
  ksl_data_free(d), ksl_model_free(m);
  CHECK_REFUSED(ksl_builder_add_force_element(b, "s", "wall", above, "lef", on_leaf, &numbers), KSL_BAD_DESCRIPTION,
                "leaf");
  CHECK_REFUSED(ksl_builder_add_force_element(b, "s", "wall", NULL, "leaf", on_leaf, &numbers), KSL_BAD_ARGUMENT,
                "null");
  CHECK(ksl_builder_add_force_element(b, "s", "wall", above, "leaf", on_leaf, &numbers) == KSL_OK);
  options.physics.force_elements = true;
  CHECK(ksl_builder_build(b, &options, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  ksl_builder_free(b);
  CHECK(ksl_model_physics(m).force_elements && ksl_model_force_elements(m) == 1);
  CHECK(strcmp(ksl_model_force_element_name(m, 0), "s") == 0 && !ksl_model_force_element_name(m, 1));
  CHECK(ksl_force_element_states(m, &q, &v, &length, &rate, &tension) == KSL_OK);
  const double l = sqrt(1.25 + sin(q)), slope = cos(q) / 2 / l; /* the leaf's end is at (cos q, 0, −sin q) / 2 */
  CHECK(fabs(length - l) < 1e-14 && fabs(rate - slope * v) < 1e-14);
  CHECK(fabs(tension - (5 + 200 * (l - 0.4) + 3 * slope * v)) < 1e-12);
  CHECK(ksl_bias(m, d, &q, &v, NULL, &with) == KSL_OK && fabs(with - without - tension * slope) < 1e-12);
  CHECK_REFUSED(ksl_force_element_states(m, NULL, &v, &length, &rate, &tension), KSL_BAD_ARGUMENT, "null");
  ksl_data_free(d), ksl_model_free(m);
}

/* Each number of a joint with several has limits; what a file or a program gets wrong is said in words. */
static void test_limits_of_several(void) {
  const double up[3] = {0, 0, 1}, downwards[3] = {0, 0, -2};
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_joint_info_t info;
  ksl_joint_options_t o = ksl_joint_options();
  const ksl_link_mass_t mass = {1, {0, 0, 0}, {{0}}};
  CHECK(ksl_builder_create("lift", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "a", NULL) == KSL_OK && ksl_builder_add_link(b, "b", &mass) == KSL_OK);
  o.axis = up, o.lower = -1, o.upper = 1, o.further_lower[0] = 0.5, o.further_upper[0] = 0.25;
  CHECK_REFUSED(ksl_builder_add_joint(b, "screw", "cylindrical", "a", "b", NULL, &o), KSL_BAD_DESCRIPTION,
                "number 2 of its position: lower limit 0.5 is above upper limit 0.25");
  CHECK_REFUSED(ksl_builder_add_joint(b, "screw", "revolute", "a", "b", NULL, &o), KSL_BAD_DESCRIPTION,
                "has no lower limit of number 2");
  o.further_lower[0] = NAN;
  CHECK_REFUSED(ksl_builder_add_joint(b, "screw", "helical", "a", "b", NULL, &o), KSL_BAD_DESCRIPTION, "screw");
  CHECK(ksl_builder_add_joint(b, "screw", "cylindrical", "a", "b", NULL, &o) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK);
  CHECK(ksl_model_joint_info(m, 0, &info) == KSL_OK);
  CHECK(info.lower[0] == -1 && info.upper[0] == 1 && isinf(info.lower[1]) && info.upper[1] == 0.25 &&
        isinf(info.upper[2]));
  CHECK(ksl_model_link(m, "bb") == -1 && strstr(ksl_error_message(), "no link named") != NULL);
  CHECK(ksl_model_joint(m, "scrw") == -1 && strstr(ksl_error_message(), "did you mean \"screw\"?") != NULL);
  ksl_model_free(m);
  ksl_builder_free(b);

  o = ksl_joint_options();
  o.axis = up, o.axis2 = downwards;
  CHECK(ksl_builder_create("bad", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "a", NULL) == KSL_OK && ksl_builder_add_link(b, "b", &mass) == KSL_OK);
  o.axis2 = NULL;
  CHECK_REFUSED(ksl_builder_add_joint(b, "j", "universal", "a", "b", NULL, &o), KSL_BAD_DESCRIPTION, "needs an axis2");
  CHECK_REFUSED(ksl_builder_add_joint(b, "j", "helical", "a", "b", NULL, &o), KSL_BAD_DESCRIPTION, "needs its pitch");
  o.axis2 = downwards;
  CHECK(ksl_builder_add_joint(b, "j", "universal", "a", "b", NULL, &o) == KSL_OK);
  CHECK_REFUSED(ksl_builder_build(b, NULL, &m), KSL_BAD_DESCRIPTION, "not parallel");
  ksl_builder_free(b);
}

static void test_models_from_models(ksl_model_t *m, const char *folder) {
  const int rod = ksl_model_link(m, "rod"), hinge = ksl_model_joint(m, "hinge");
  const double q = 0.3, g = 9.81, moment = 2 * 0.5 * g * sin(q);
  ksl_model_t *made = NULL, *other = NULL;
  CHECK(close_to(held(m, q), moment));
  CHECK(ksl_model_mass(m) == 2 && ksl_model_subtree_mass(m, hinge) == 2 && ksl_model_subtree_mass(m, 99) == 0);
  CHECK(ksl_model_joint_above(m, rod) == hinge && ksl_model_parent_link(m, rod) == 0 &&
        ksl_model_parent_link(m, 0) == -1);
  CHECK(ksl_model_parent_link(m, 99) == -1);

  const ksl_link_mass_t tool = {1, {0, 0, -1}, {{0}}};
  CHECK(ksl_model_with_payload(m, rod, &tool, &made) == KSL_OK);
  CHECK(close_to(held(made, q), moment + g * sin(q)));
  ksl_model_free(made);

  const double stone[10] = {4, 0, 0, -2, 1, 0, 1, 0, 0, 0};
  CHECK(ksl_model_with_parameters(m, 1, &rod, stone, &made) == KSL_OK);
  CHECK(close_to(held(made, q), 2 * moment));
  ksl_model_free(made);

  const double moon[3] = {0, 0, -1.62}, odd[3] = {0, 0, NAN};
  CHECK(ksl_model_with_gravity(m, moon, &made) == KSL_OK);
  CHECK(close_to(held(made, q), moment * 1.62 / g));
  ksl_model_free(made);
  CHECK(ksl_model_with_gravity(m, odd, &made) != KSL_OK && ksl_model_with_gravity(m, NULL, &made) != KSL_OK);

  CHECK(ksl_model_with_frozen_joints(m, 1, &hinge, &q, &made) == KSL_OK);
  CHECK(ksl_model_nv(made) == 0 && ksl_model_links(made) == 2);
  ksl_model_free(made);

  CHECK(ksl_model_with_root(m, rod, &made) == KSL_OK);
  CHECK(!strcmp(ksl_model_link_name(made, 0), "rod") && ksl_model_nv(made) == 1 &&
        held(made, q) == 0); /* the ceiling weighs nothing */
  ksl_model_free(made);

  const ksl_SE3_t below = ksl_SE3_fromRt(ksl_mat3x3(1, 0, 0, 0, 1, 0, 0, 0, 1), ksl_vec3(0, 0, -1));
  CHECK_REFUSED(ksl_model_merged(m, m, rod, &below, NULL, &made), KSL_BAD_DESCRIPTION, "give a prefix");
  CHECK(made == NULL);
  CHECK(ksl_model_merged(m, m, rod, &below, "second_", &made) == KSL_OK);
  CHECK(ksl_model_nv(made) == 2 && ksl_model_mass(made) == 4);
  CHECK(ksl_model_subtree(made, ksl_model_link(made, "second_ceiling"), &other) == KSL_OK);
  CHECK(close_to(held(other, q), moment));
  ksl_model_free(other);
  ksl_model_free(made);

  CHECK(ksl_model_with_frame(m, "tip", rod, &below, &made) == KSL_OK);
  CHECK(ksl_model_link(made, "tip") == 2 && held(made, q) == held(m, q));
  ksl_model_free(made);
  CHECK_REFUSED(ksl_model_with_frame(m, "rod", rod, &below, &made), KSL_BAD_DESCRIPTION, "has that name");
  CHECK_REFUSED(ksl_model_with_root(m, 99, &made), KSL_BAD_ARGUMENT, "out of range");

  char path[4096];
  snprintf(path, sizeof path, "%s/written.urdf", folder);
  CHECK(ksl_model_write_urdf(m, path) == KSL_OK);
  CHECK(ksl_model_load(path, NULL, &made) == KSL_OK);
  CHECK(held(made, q) == held(m, q));
  ksl_model_free(made);
}

static void test_table(void) {
  const ksl_dh_row_t rows[2] = {{1, 0, 0, 0, NULL, {1, {0}, {{0}}}}, {2, 0, 0, 0, "revolute", {1, {0}, {{0}}}}};
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_data_t *d = NULL;
  ksl_SE3_t end;
  const double q[2] = {0.3, 0.4};
  CHECK(ksl_builder_create("arm", &b) == KSL_OK && ksl_builder_add_link(b, "base", NULL) == KSL_OK);
  CHECK(ksl_builder_add_dh_chain(b, "base", 2, rows, KSL_DH_STANDARD, NULL) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK && ksl_data_create(m, &d) == KSL_OK);
  CHECK(ksl_frame_pose(m, d, q, ksl_model_link(m, "link2"), &end) == KSL_OK);
  CHECK(close_to(end.t.x, cos(0.3) + 2 * cos(0.7)) && close_to(end.t.y, sin(0.3) + 2 * sin(0.7)));
  ksl_data_free(d);
  ksl_model_free(m);
  ksl_builder_free(b);
}

int main(int argc, char **argv) {
  if (argc != 2)
    return 1;
  ksl_model_t *m = pendulum();
  test_models_from_models(m, argv[1]);
  ksl_model_free(m);
  test_table();
  test_limits_of_several();
  test_force_elements();
  test_loops();
  return exit_status();
}
