/* Marks around each period of the example's controller: linked with --wrap=control_step. */
#include "control.h"

void mark(void);
int __real_control_step(controller *, const float *, const float *, const reference *, float *);
int __wrap_control_step(controller *, const float *, const float *, const reference *, float *);

__attribute__((noinline)) void mark(void) { __asm volatile("" ::: "memory"); }

int __wrap_control_step(controller *self, const float *q, const float *v, const reference *wished, float *tau) {
  int touched;
  mark(), mark(), mark(); /* the second and the third have nothing between */
  touched = __real_control_step(self, q, v, wished, tau);
  mark();
  return touched;
}
