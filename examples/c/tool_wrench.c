/* A wrench sensor sits between a robot's flange and its gripper.  What does the gripper press with, where and about
   which axis, once its own weight is taken off?

     cc -Iinclude examples/c/tool_wrench.c -lm && ./a.out */
#include <ksl/ksl.h>
#include <stdio.h>

static void print(const char *label, const ksl_coscrew_t *c) {
  printf("%-28s force %7.3f %7.3f %7.3f N, moment %7.4f %7.4f %7.4f N m\n", label, c->m0, c->m1, c->m2, c->m3, c->m4,
         c->m5);
}

int main(void) {
  /* the sensor, seen from the world: pointing down, 0.8 m above the table */
  const ksl_SE3_t world_sensor = ksl_SE3_fromRt(ksl_mat3x3(1, 0, 0, 0, -1, 0, 0, 0, -1), ksl_vec3(0.5, 0, 0.8));
  /* the finger tip, seen from the sensor */
  const ksl_SE3_t sensor_tip = ksl_SE3_fromRt(ksl_mat3x3(1, 0, 0, 0, 1, 0, 0, 0, 1), ksl_vec3(0, 0.02, 0.15));
  const double mass = 0.9;                          /* of the gripper, kg, */
  const ksl_vec3_t centroid = ksl_vec3(0, 0, 0.06); /* with its centroid here in the sensor's frame, m */
  const ksl_coscrew_t measured =
      ksl_coscrew(1.5, 0, 0.8, -0.15, 0.3, -0.03); /* by sensor on gripper, in the sensor's frame */

  /* gravity on the gripper: a force at the centroid, turned from the world's axes to the sensor's */
  const ksl_vec3_t down = ksl_vec3(0, 0, -9.81 * mass);
  ksl_vec3_t weight_force;
  ksl_product_drinvv(&world_sensor.R, &down, &weight_force);
  ksl_coscrew_t weight;
  ksl_coscrew_fromForce(&centroid, &weight_force, &weight);

  /* the gripper is at rest: sensor + weight + contact = 0, so it presses on its surroundings with sensor + weight */
  ksl_coscrew_t pressed, at_tip;
  ksl_add_cc(&measured, &weight, &pressed);
  ksl_product_CoAdinvc(&sensor_tip, &pressed, &at_tip); /* the same wrench, about the tip */
  print("measured, at the sensor", &measured);
  print("pressed, at the sensor", &pressed);
  print("pressed, at the tip", &at_tip);

  ksl_vec3_t direction, point;
  double pitch;
  const double force = ksl_coscrew_getAxis(&at_tip, &direction, &point, &pitch);
  printf("%.3f N along an axis %.4f m from the tip, with %.4f N m about it\n", force, ksl_vec3_l2norm(&point),
         pitch * force);
  return 0;
}
