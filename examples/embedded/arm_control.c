/* A control loop for a microcontroller: the motor torques of a three-joint arm that carries its tool's weight and
   presses with a wished wrench, in single precision, with the one-file header (make release).  No heap, no C library
   but sinf and cosf; what the compiler makes of arithmetic without a floating-point unit apart.

     clang -target thumbv7em-none-eabihf -mfpu=fpv4-sp-d16 -ffreestanding -O2 -Ibuild/release -c arm_control.c
     cc -Ibuild/release arm_control.c -lm && ./a.out        on a PC: prints one step */
#include "ksl.h"

enum { JOINTS = 3 };

/* Each joint's frame at angle zero, seen from the one before: about its z axis the joint turns.  The tool's frame last.
 */
typedef struct arm {
  ksl_SE3f_t before[JOINTS], tool;
  float tool_mass;           /* kg */
  ksl_vec3f_t tool_centroid; /* in the tool's frame, m */
} arm;

/* torques that hold the tool and let it press on its surroundings with `press`, in the tool's frame at its origin */
void control_step(const arm *self, const float angles[JOINTS], const ksl_coscrewf_t *press, float torques[JOINTS]);

void control_step(const arm *self, const float angles[JOINTS], const ksl_coscrewf_t *press, float torques[JOINTS]) {
  ksl_SE3f_t pose = ksl_SE3f_identity();
  ksl_screwf_t motion[JOINTS]; /* each joint's unit twist, in the base */
  for (int i = 0; i < JOINTS; i++) {
    float dc[2];
    ksl_dcf(angles[i], dc);
    ksl_product_ddf(&pose, &self->before[i], &pose);
    ksl_product_ddrzf(&pose, dc, &pose);
    ksl_hsrzf(&pose, &motion[i]);
  }
  ksl_product_ddf(&pose, &self->tool, &pose);

  /* what the arm must supply: the pressing wrench, and the opposite of the weight */
  ksl_coscrewf_t supplied, lift;
  ksl_vec3f_t centroid, up = ksl_vec3f(0.0f, 0.0f, 9.81f * self->tool_mass);
  ksl_product_dvf(&pose, &self->tool_centroid, &centroid);
  ksl_coscrewf_fromForce(&centroid, &up, &lift);
  ksl_product_CoAdcf(&pose, press, &supplied);
  ksl_xpy_ccf(&lift, &supplied);

  for (int i = 0; i < JOINTS; i++)
    torques[i] = ksl_dot_csf(&supplied, &motion[i]);
}

#ifndef KSL_FREESTANDING
/* links of 0.4 m and 0.3 m along x, all axes horizontal, a tool of 2 kg 0.2 m farther out */
int main(void) {
  const ksl_mat3x3f_t same = ksl_mat3x3f(1, 0, 0, 0, 1, 0, 0, 0, 1), level = ksl_mat3x3f(1, 0, 0, 0, 0, -1, 0, 1, 0);
  arm a;
  a.before[0] = ksl_SE3f_fromRt(level, ksl_vec3f(0, 0, 0));
  a.before[1] = ksl_SE3f_fromRt(same, ksl_vec3f(0.4f, 0, 0));
  a.before[2] = ksl_SE3f_fromRt(same, ksl_vec3f(0.3f, 0, 0));
  a.tool = ksl_SE3f_fromRt(same, ksl_vec3f(0.2f, 0, 0));
  a.tool_mass = 2.0f;
  a.tool_centroid = ksl_vec3f(0, 0, 0);

  const float angles[JOINTS] = {0.0f, 0.0f, 0.0f};
  const ksl_coscrewf_t nothing = ksl_coscrewf(0, 0, 0, 0, 0, 0), five_up = ksl_coscrewf(0, 5, 0, 0, 0, 0);
  float torques[JOINTS];
  control_step(&a, angles, &nothing, torques);
  printf("holding   %.3f %.3f %.3f N m\n", (double)torques[0], (double)torques[1], (double)torques[2]);
  control_step(&a, angles, &five_up, torques);
  printf("pressing  %.3f %.3f %.3f N m\n", (double)torques[0], (double)torques[1], (double)torques[2]);
  return 0;
}
#endif
