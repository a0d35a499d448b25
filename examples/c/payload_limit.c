/* How heavy may a robot's payload be, so that every motor holds it with the arm stretched out?  The robot is in memory, as a program
   has it that generated it or received it over a network.  Where the library has been built in build/release, as README says:

     cc -Iinclude examples/c/payload_limit.c -Lbuild/release -Wl,-rpath,build/release -lksl -lm
     ./a.out */
#include <ksl/engine.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char robot[] =
    "<robot name='crane'>\n"
    "  <link name='mast'/>\n"
    "  <link name='boom'><inertial><origin xyz='1 0 0'/><mass value='20'/>\n"
    "    <inertia ixx='0.1' iyy='7' izz='7' ixy='0' ixz='0' iyz='0'/></inertial></link>\n"
    "  <link name='jib'><inertial><origin xyz='0.5 0 0'/><mass value='5'/>\n"
    "    <inertia ixx='0.01' iyy='0.5' izz='0.5' ixy='0' ixz='0' iyz='0'/></inertial></link>\n"
    "  <link name='hook'/>\n"
    "  <joint name='luff' type='revolute'><parent link='mast'/><child link='boom'/><axis xyz='0 -1 0'/>\n"
    "    <limit lower='0' upper='1.4' effort='900' velocity='0.5'/></joint>\n"
    "  <joint name='fold' type='revolute'><parent link='boom'/><child link='jib'/><origin xyz='2 0 0'/><axis xyz='0 -1 0'/>\n"
    "    <limit lower='-2' upper='0' effort='200' velocity='1'/></joint>\n"
    "  <joint name='rope' type='fixed'><parent link='jib'/><child link='hook'/><origin xyz='1 0 0'/></joint>\n"
    "</robot>\n";

/* Torques that hold the robot with this mass on its hook, q being its neutral position. */
static ksl_status_t holding_torques(double mass, double *tau, ksl_model_t **model) {
  ksl_model_options_t options = ksl_model_options();
  const ksl_payload_t payload = {"hook", mass, {0, 0, 0}};
  options.payloads_n = 1;
  options.payloads = &payload;
  ksl_status_t status = ksl_model_load_memory(robot, strlen(robot), &options, model);
  if (status != KSL_OK)
    return status;
  ksl_data_t *data = NULL;
  double q[8];
  if ((status = ksl_data_create(*model, &data)) == KSL_OK && (status = ksl_neutral(*model, q)) == KSL_OK)
    status = ksl_gravity_torque(*model, data, q, NULL, tau);
  ksl_data_free(data);
  if (status != KSL_OK)
    ksl_model_free(*model);
  return status;
}

int main(void) {
  double empty[8], loaded[8];
  ksl_model_t *model, *with_one_kilogram;
  if (holding_torques(0, empty, &model) != KSL_OK || holding_torques(1, loaded, &with_one_kilogram) != KSL_OK) {
    fprintf(stderr, "%s\n", ksl_error_message());
    return 1;
  }
  double most = HUGE_VAL;
  for (int i = 0; i < ksl_model_moving_joints(model); ++i) {
    ksl_joint_info_t joint;
    ksl_model_joint_info(model, i, &joint);
    const double own = empty[joint.v_index], for_each_kilogram = loaded[joint.v_index] - own;
    printf("%s (%s, carries %s and %.0f kg): %.1f N m of %.0f N m, and %.2f N m more for each kilogram\n",
           ksl_model_joint_name(model, i), joint.kind, ksl_model_link_name(model, joint.link),
           ksl_model_subtree_mass(model, i), own, joint.effort, for_each_kilogram);
    most = fmin(most, (joint.effort - own) / for_each_kilogram); /* its effort is linear in the mass */
  }
  printf("the hook holds %.2f kg\n", most);
  ksl_model_free(model);
  ksl_model_free(with_one_kilogram);
  return 0;
}
