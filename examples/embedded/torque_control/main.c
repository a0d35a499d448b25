/* The arm and its controller for a second: after 500 ms something pushes the flange with 40 N.  Without hardware, the arm is forward dynamics:

     ksl generate examples/robots/ur5.urdf -o build/plant --name plant --scalar float \
       --algorithms forward_dynamics,mass_matrix --arguments external:tool0
     E=examples/embedded/torque_control; cc -O2 -ffp-contract=off -Ibuild/arm -Ibuild/plant $E/control.c $E/main.c build/arm/arm.c build/plant/plant.c -lm

   Ends with status 1 where the collision is missed, or noticed where there is none. */
#include "control.h"
#include "plant.h"

#include <stdio.h>

enum { SECOND = 1000, CONTACT = 500, PARTS = 4 };

static const float from[ARM_NQ] = {0.0f, -1.2f, 1.0f, -1.0f, -1.5f, 0.0f},
                   to[ARM_NQ] = {1.0f, -0.8f, 1.4f, -1.4f, -1.0f, 0.5f};

/* From rest to rest in a second, by a polynomial of fifth order. */
static void wish(float t, reference *wished) {
  const float s = t * t * t * (10.0f + t * (6.0f * t - 15.0f)), ds = 30.0f * t * t * (1.0f + t * (t - 2.0f)),
              dds = 60.0f * t * (1.0f + t * (2.0f * t - 3.0f));
  for (int i = 0; i < ARM_NQ; ++i) {
    wished->q[i] = from[i] + (to[i] - from[i]) * s;
    wished->v[i] = (to[i] - from[i]) * ds;
    wished->a[i] = (to[i] - from[i]) * dds;
  }
}

/* A millisecond of the arm in four steps. */
static void move(float q[ARM_NQ], float v[ARM_NV], const float tau[ARM_NV], const float push[6]) {
  const float h = 0.001f / PARTS;
  for (int part = 0; part < PARTS; ++part) {
    float a[ARM_NV];
    plant_forward_dynamics(q, v, tau, push, a);
    for (int i = 0; i < ARM_NV; ++i) {
      v[i] += h * a[i];
      q[i] += h * v[i];
    }
  }
}

/* What the push is in efforts: the mass matrix times the acceleration that it adds. */
static void efforts_of(const float push[6], const float q[ARM_NQ], const float v[ARM_NV], const float tau[ARM_NV],
                       float efforts[ARM_NV]) {
  static const float nothing[6] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
  float with[ARM_NV], without[ARM_NV], M[ARM_NV * ARM_NV];
  plant_forward_dynamics(q, v, tau, push, with);
  plant_forward_dynamics(q, v, tau, nothing, without);
  plant_mass_matrix(q, M);
  for (int i = 0; i < ARM_NV; ++i) {
    efforts[i] = 0.0f;
    for (int j = 0; j < ARM_NV; ++j)
      efforts[i] += M[i * ARM_NV + j] * (with[j] - without[j]);
  }
}

int main(void) {
  float q[ARM_NQ], v[ARM_NV] = {0.0f}, tau[ARM_NV], push[6] = {0.0f}, efforts[ARM_NV];
  int noticed = -1;
  controller control;
  for (int i = 0; i < ARM_NQ; ++i)
    q[i] = from[i];
  control_start(&control, q, v);
  for (int t = 0; t < SECOND; ++t) {
    reference wished;
    wish((float)t / SECOND, &wished);
    push[1] = t < CONTACT ? 0.0f : 40.0f;
    if (control_step(&control, q, v, &wished, tau) && noticed < 0)
      noticed = t;
    if (t == CONTACT + 100)
      break; /* an arm would have stopped */
    move(q, v, tau, push);
  }
  efforts_of(push, q, v, tau, efforts);
  printf("contact at %d ms, noticed at %d ms\n", CONTACT, noticed);
  for (int i = 0; i < ARM_NV; ++i)
    printf("%s: residual %.1f N m, contact %.1f N m\n", arm_position_names[i], (double)control.residual[i],
           (double)efforts[i]);
  return noticed < CONTACT || noticed > CONTACT + 20;
}
