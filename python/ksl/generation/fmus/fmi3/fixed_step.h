/* A mechanism in motion: one step of length h under constant efforts.  The operations and their order are those of KSL's m.simulate, so that bits are the same
   where positions move by addition.  fmu_real, fmu_accelerate, fmu_move and sizes are those of fmu_model.h. */
#ifndef KSL_FIXED_STEP_H
#define KSL_FIXED_STEP_H

#if FMU_RK4
/* The classical Runge-Kutta method of order 4; where joints have several coordinates, by compositions of exponentials: Celledoni, Marthinsen and Owren,
   Commutator-free Lie group methods (2003), table 2. */
static void fmu_fixed_step(fmu_real h, fmu_real *q, fmu_real *v, const fmu_real *tau, const fmu_real *a) {
  fmu_real half_q[FMU_NQ], last_q[FMU_NQ], u[FMU_NV];
  fmu_real v2[FMU_NV], v3[FMU_NV], v4[FMU_NV], a2[FMU_NV], a3[FMU_NV], a4[FMU_NV];
  int i;
  for (i = 0; i < FMU_NV; ++i) {
    u[i] = h / 2 * v[i];
    v2[i] = v[i] + h / 2 * a[i];
  }
  fmu_move(q, u, half_q);
  fmu_accelerate(half_q, v2, tau, a2);
  for (i = 0; i < FMU_NV; ++i) {
    u[i] = h / 2 * v2[i];
    v3[i] = v[i] + h / 2 * a2[i];
  }
  fmu_move(q, u, last_q);
  fmu_accelerate(last_q, v3, tau, a3);
  for (i = 0; i < FMU_NV; ++i) { /* the fourth stage starts at the second one's position */
    u[i] = h * v3[i] + -h / 2 * v[i];
    v4[i] = v[i] + h * a3[i];
  }
  fmu_move(half_q, u, last_q);
  fmu_accelerate(last_q, v4, tau, a4);
#if FMU_FLAT
  for (i = 0; i < FMU_NV; ++i)
    u[i] = h / 6 * v[i] + h / 3 * v2[i] + h / 3 * v3[i] + h / 6 * v4[i];
  fmu_move(q, u, q);
#else
  for (i = 0; i < FMU_NV; ++i)
    u[i] = h / 4 * v[i] + h / 6 * v2[i] + h / 6 * v3[i] + -h / 12 * v4[i];
  fmu_move(q, u, last_q);
  for (i = 0; i < FMU_NV; ++i)
    u[i] = -h / 12 * v[i] + h / 6 * v2[i] + h / 6 * v3[i] + h / 4 * v4[i];
  fmu_move(last_q, u, q);
#endif
  for (i = 0; i < FMU_NV; ++i)
    v[i] += h / 6 * a[i] + h / 3 * a2[i] + h / 3 * a3[i] + h / 6 * a4[i];
}
#else
/* v' = v + h a(q, v), q' = q moved by h v': order 1. */
static void fmu_fixed_step(fmu_real h, fmu_real *q, fmu_real *v, const fmu_real *tau, const fmu_real *a) {
  fmu_real u[FMU_NV];
  int i;
  (void)tau;
  for (i = 0; i < FMU_NV; ++i) {
    v[i] += h * a[i];
    u[i] = h * v[i];
  }
  fmu_move(q, u, q);
}
#endif

#endif
