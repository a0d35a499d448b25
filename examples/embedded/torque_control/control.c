/* Computed torque, and a momentum observer that notices a collision (De Luca and Mattone, 2005), of code that KSL generates for one arm:

     ksl generate examples/robots/ur5.urdf -o build/arm --name arm --scalar float \
       --algorithms inverse_dynamics,mass_matrix,coriolis_matrix,gravity_torque

   The generalised momentum p = M v changes by p' = tau + transpose(C) v - g + what comes from outside.  The residual follows the last term as a filter of
   first order does, and needs no acceleration. */
#include "control.h"

static const float period = 0.001f;    /* s */
static const float stiffness = 400.0f; /* 1/s²: 20 rad/s, critically damped */
static const float damping = 40.0f;    /* 1/s */
static const float observer = 100.0f;  /* 1/s: a residual has 63 % of a step after 10 ms */
static const float threshold[ARM_NV] = {8.0f, 8.0f, 6.0f, 2.0f, 2.0f, 1.0f}; /* N m */

static void momentum(const float M[ARM_NV * ARM_NV], const float v[ARM_NV], float p[ARM_NV]) {
  for (int i = 0; i < ARM_NV; ++i) {
    p[i] = 0.0f;
    for (int j = 0; j < ARM_NV; ++j)
      p[i] += M[i * ARM_NV + j] * v[j];
  }
}

void control_start(controller *self, const float q[ARM_NQ], const float v[ARM_NV]) {
  float M[ARM_NV * ARM_NV];
  arm_mass_matrix(q, M);
  momentum(M, v, self->integral);
  for (int i = 0; i < ARM_NV; ++i)
    self->residual[i] = 0.0f;
}

int control_step(controller *self, const float q[ARM_NQ], const float v[ARM_NV], const reference *wished,
                 float tau[ARM_NV]) {
  float a[ARM_NV], M[ARM_NV * ARM_NV], C[ARM_NV * ARM_NV], g[ARM_NV], p[ARM_NV];
  int touched = 0;
  for (int i = 0; i < ARM_NV; ++i)
    a[i] = wished->a[i] + stiffness * (wished->q[i] - q[i]) + damping * (wished->v[i] - v[i]);
  arm_inverse_dynamics(q, v, a, tau);

  arm_mass_matrix(q, M);
  arm_coriolis_matrix(q, v, C);
  arm_gravity_torque(q, g);
  momentum(M, v, p);
  for (int i = 0; i < ARM_NV; ++i) {
    float changes = tau[i] - g[i];
    self->residual[i] = observer * (p[i] - self->integral[i]);
    for (int j = 0; j < ARM_NV; ++j)
      changes += C[j * ARM_NV + i] * v[j];
    self->integral[i] += period * (changes + self->residual[i]);
    touched |= self->residual[i] > threshold[i] || self->residual[i] < -threshold[i];
  }
  return touched;
}
