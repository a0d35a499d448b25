/* Torques of the motors, and what the bearings of each joint carry, of a robot on a motion: for one state with reactions of all joints, and for
   a whole motion in one call.  Where the library has been built in build/release, as README says:

     cc -Iinclude examples/c/joint_loads.c -Lbuild/release -Wl,-rpath,build/release -lksl -lm
     ./a.out */
#include <ksl/engine.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOVING = 7, ALL = 9, SAMPLES = 501 };

/* A call that fails says in one sentence what is wrong. */
static void check(ksl_status_t status) {
  if (status == KSL_OK)
    return;
  fprintf(stderr, "%s\n", ksl_error_message());
  exit(1);
}

/* Every joint swings by 0.3 rad about 0.5 rad, twice a second. */
static void motion_at(double time, double *q, double *v, double *a) {
  const double frequency = 4 * 3.14159265358979323846, swing = 0.3;
  for (int i = 0; i < MOVING; ++i) {
    q[i] = 0.5 + swing * sin(frequency * time);
    v[i] = swing * frequency * cos(frequency * time);
    a[i] = -swing * frequency * frequency * sin(frequency * time);
  }
}

static double size_of(const double *x) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/* One state: the efforts, and from the same workspace the wrench through each joint. */
static void one_state(const ksl_model_t *model) {
  ksl_data_t *data = NULL; /* the memory of calls for one state, one for each thread */
  check(ksl_data_create(model, &data));
  double q[MOVING], v[MOVING] = {0}, a[MOVING] = {0}, tau[MOVING];
  check(ksl_neutral(model, q));
  check(ksl_inverse_dynamics(model, data, q, v, a, NULL, tau));
  int joints[ALL];
  double wrench[ALL][6]; /* force, then moment, that the parent side exerts on the child side */
  for (int j = 0; j < ALL; ++j)
    joints[j] = j;                      /* the moving ones first, `base` to the ground last */
  ksl_reaction_options_t options = {0}; /* at the joint's origin, in the child's axes */
  options.part = KSL_CONSTRAINT;        /* what the bearings carry: all but the motor's moment */
  check(ksl_reactions(model, data, ALL, joints, &options, NULL, wrench[0]));
  for (int j = 0; j < ALL; ++j)
    printf("%-18s motor %8.3f N m, bearings %7.2f N and %7.3f N m\n", ksl_model_joint_name(model, j),
           j < MOVING && fabs(tau[j]) > 1e-9 ? tau[j] : 0.0, size_of(wrench[j]), size_of(wrench[j] + 3));
  ksl_data_free(data);
}

/* A whole motion: a row of each array for each sample.  The rows of a result must not overlap. */
static void whole_motion(const ksl_model_t *model) {
  static double q[SAMPLES][MOVING], v[SAMPLES][MOVING], a[SAMPLES][MOVING], tau[SAMPLES][MOVING], wrench[SAMPLES][6];
  for (int k = 0; k < SAMPLES; ++k)
    motion_at(0.001 * k, q[k], v[k], a[k]);
  const int second = ksl_model_joint(model, "panda_joint2");
  const ksl_reaction_options_t whole = {0}; /* part: the total */
  check(ksl_inverse_dynamics_with_reactions_batch(model, SAMPLES, q[0], MOVING, v[0], MOVING, a[0], MOVING, tau[0],
                                                  MOVING, 1, &second, &whole, wrench[0], 6, 0));
  double largest = 0, force = 0, difference = 0;
  for (int k = 0; k < SAMPLES; ++k) {
    largest = fmax(largest, fabs(tau[k][1]));
    force = fmax(force, size_of(wrench[k]));
    difference = fmax(difference, fabs(wrench[k][5] - tau[k][1])); /* the joint's axis is z of its child */
  }
  printf(
      "over the motion, panda_joint2: motor %.2f N m at most, bearings %.1f N; they differ by %.0e N m about the axis\n",
      largest, force, difference);
}

int main(void) {
  ksl_model_t *model = NULL;
  check(ksl_model_load("examples/robots/panda.urdf", NULL, &model));
  if (ksl_model_nv(model) != MOVING || ksl_model_joints(model) != ALL)
    return 1;
  one_state(model);
  whole_motion(model);
  ksl_model_free(model);
  return 0;
}
