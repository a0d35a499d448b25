/* Torque control of a six-axis arm that notices what it touches, for one call a millisecond: see control.c. */
#ifndef CONTROL_H
#define CONTROL_H

#include "arm.h"

/* Where the arm is to be, and how it is to move there: rad, rad/s, rad/s². */
typedef struct reference { float q[ARM_NQ], v[ARM_NV], a[ARM_NV]; } reference;

/* What is kept from period to period. */
typedef struct controller {
  float integral[ARM_NV]; /* of all that changes the generalised momentum, N m s */
  float residual[ARM_NV]; /* estimate of the efforts that come from outside, N m */
} controller;

/* q, v: at rest or moving, with nothing touching the arm. */
void control_start(controller *self, const float q[ARM_NQ], const float v[ARM_NV]);

/* One period.  Writes tau, the efforts of the motors in N m, and returns 1 where a residual is beyond what friction and noise explain. */
int control_step(controller *self, const float q[ARM_NQ], const float v[ARM_NV], const reference *wished,
                 float tau[ARM_NV]);

#endif
