/* A pendulum and a block from C, against closed forms.  Returns 1 if a check fails. */
#include "../c_api/c_checks.h"

#include <ksl/ksl.h>

static ksl_model_t *one_joint(const char *kind, const double *axis, const ksl_link_mass_t *mass) {
  ksl_builder_t *b = NULL;
  ksl_model_t *m = NULL;
  ksl_joint_options_t options = ksl_joint_options();
  options.axis = axis;
  CHECK(ksl_builder_create("one joint", &b) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "world", NULL) == KSL_OK);
  CHECK(ksl_builder_add_link(b, "body", mass) == KSL_OK);
  CHECK(ksl_builder_add_joint(b, "joint", kind, "world", "body", NULL, &options) == KSL_OK);
  CHECK(ksl_builder_build(b, NULL, &m) == KSL_OK);
  ksl_builder_free(b);
  return m;
}

/* Small swings about the lowest position: the period is 2π √(I / (m g l)) (1 + A²/16 + 11 A⁴/3072), A the amplitude. */
static void test_period(void) {
  const double y[3] = {0, 1, 0}, A = 0.02, I = 0.02 + 2 * 0.3 * 0.3, pi = 3.14159265358979323846;
  const ksl_link_mass_t rod = {2, {0, 0, -0.3}, {{0.02, 0, 0}, {0, 0.02, 0}, {0, 0, 0.02}}};
  ksl_model_t *m = one_joint("continuous", y, &rod);
  const double period = 2 * pi * sqrt(I / (2 * 9.81 * 0.3)) * (1 + A * A / 16 + 11 * A * A * A * A / 3072);
  const double zero = 0, times[3] = {0, period / 2, period};
  double q[3], v[3], kinetic[3], potential[3], work[3];
  ksl_run_end_t end;
  ksl_simulation_t task = ksl_simulation();
  ksl_simulation_results_t out = {0};
  task.runs = 1, task.q = &A, task.v = &zero, task.times_n = 3, task.times = times;
  out.q = q, out.v = v, out.kinetic = kinetic, out.potential = potential, out.work = work, out.ends = &end;
  for (int method = KSL_RK4; method <= KSL_SDIRK4; ++method) {
    task.method = (ksl_stepping_t)method;
    task.step = method == KSL_DOP853 ? 0 : period / 1000;
    CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_OK);
    CHECK(end.how == KSL_COMPLETE && end.time == period && end.steps > 3);
    CHECK(fabs(q[1] + A) < 1e-9 && fabs(q[2] - A) < 1e-9 && fabs(v[2]) < 1e-7);
    CHECK(fabs(kinetic[1] + potential[1] - potential[0]) < 1e-9 && work[2] == 0);
  }
  task.method = KSL_VARIATIONAL, task.step = 0;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "step"));
  ksl_model_free(m);
}

static bool push(void *context, size_t first, size_t n, double t, const double *q, const double *v, double *tau) {
  (void)first, (void)q, (void)v;
  for (size_t k = 0; k < n; ++k)
    tau[k] = *(const double *)context;
  return t <= 10;
}

/* A block of 2 kg that is pushed by 1 N and braked by 8 N from 1 s on, when the push ends: it stops after 2.5 m/s / 4 m/s². */
static void test_brake(void) {
  const double x[3] = {1, 0, 0}, q = 0, v = 2, brake = 8, times[3] = {0, 1, 3};
  const ksl_link_mass_t block = {2, {0, 0, 0}, {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}};
  ksl_model_t *m = one_joint("prismatic", x, &block);
  double at[3], newton = 1;
  ksl_simulated_event_t events[4];
  ksl_simulation_t task = ksl_simulation();
  ksl_simulation_results_t out = {0};
  ksl_exact_laws_t laws = {0};
  task.runs = 1, task.q = &q, task.v = &v, task.times_n = 3, task.times = times;
  task.drives.function = push, task.drives.context = &newton;
  laws.brake = &brake, laws.brake_at = 1, laws.cut_efforts = true;
  out.q = at, out.events = events, out.events_room = 4;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_OK);
  CHECK(out.events_n == 2 && events[0].what == KSL_BRAKES && events[1].what == KSL_STICKS);
  CHECK(fabs(events[1].time - 1.625) < 1e-10 && fabs(at[2] - (2.25 + 2.5 * 2.5 / 8)) < 1e-9);
  task.method = KSL_RK4, task.step = 0.2;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_OK && fabs(events[1].time - 1.625) < 1e-12);
  task.method = KSL_VARIATIONAL;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "variational"));
  const double wrong = -1;
  laws.friction = &wrong;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "dry friction"));
  const double half = 0.5, low = 1, high = 2;
  laws.friction = NULL, laws.restitution = &half, laws.lower = &low, laws.upper = &high;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "begin within"));
  laws.lower = &high, laws.upper = &low;
  CHECK(ksl_simulate(m, &task, &laws, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "lower limits"));
  const double later[2] = {0, INFINITY};
  task.method = KSL_DOP853, task.times_n = 2, task.times = later;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "finite"));
  task.times = times, task.drives.function = NULL, task.drives.damping = &half;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "need positions"));
  const ksl_coscrew_t wrench = ksl_coscrew(1, 0, 0, 0, 0, NAN);
  const int link = 1, nobody = 99;
  const struct {
    ksl_external_t given;
    const char *words;
  } refused[] = {{{1, &link, NULL, KSL_IN_FRAME}, "external needs n links and n wrenches"},
                 {{1, NULL, &wrench, KSL_IN_FRAME}, "external needs n links and n wrenches"},
                 {{-1, &link, &wrench, KSL_IN_FRAME}, "external needs n links and n wrenches"},
                 {{1, &nobody, &wrench, KSL_IN_FRAME}, "link[0] is 99"},
                 {{1, &link, &wrench, KSL_IN_FRAME}, "external wrench[5]"}};
  for (int k = 0; k < 5; ++k) {
    CHECK(ksl_simulate(m, &task, NULL, &refused[k].given, &out) == KSL_BAD_ARGUMENT);
    CHECK(strstr(ksl_error_message(), refused[k].words) != NULL);
  }
  task.method = (ksl_stepping_t)17;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "method"));
  task.q = NULL;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT);
  ksl_model_free(m);
}

static bool heights(void *context, size_t run, double t, const double *q, const double *v, double *values) {
  (void)run, (void)t, (void)v;
  for (int k = 0; k < 2; ++k)
    values[k] = q[0] - ((const double *)context)[k];
  return true;
}

static bool count(void *context, size_t first, double t) {
  (void)first, (void)t;
  return ++*(int *)context < 3;
}

/* A block that is thrown up at 5 m/s passes 1 m, which is told once, where it rises, and ends at 0.5 m on its way down. */
static void test_events(void) {
  const double z[3] = {0, 0, 1}, q = 0, v = 5, times[2] = {0, 3}, g = 9.81;
  double at[2] = {1, 0.5};
  const ksl_link_mass_t block = {2, {0, 0, 0}, {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}};
  const ksl_event_rule_t rules[2] = {{1, false}, {-1, true}};
  ksl_model_t *m = one_joint("prismatic", z, &block);
  ksl_simulated_event_t events[4];
  ksl_run_end_t end;
  ksl_simulation_t task = ksl_simulation();
  ksl_simulation_results_t out = {0};
  int steps = 0;
  task.runs = 1, task.q = &q, task.v = &v, task.times_n = 2, task.times = times;
  task.events_n = 2, task.events = rules, task.event_values = heights, task.event_context = at;
  out.events = events, out.events_room = 4, out.ends = &end;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_OK);
  CHECK(out.events_n == 2 && events[0].what == KSL_AT_EVENT && events[0].coordinate == 0 && events[1].coordinate == 1);
  CHECK(fabs(events[0].time - (v - sqrt(v * v - 2 * g * at[0])) / g) < 1e-9);
  CHECK(end.how == KSL_ENDED_BY_EVENT && fabs(end.time - (v + sqrt(v * v - 2 * g * at[1])) / g) < 1e-9);
  at[0] = NAN;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_OK && end.how == KSL_RUN_NOT_FINITE && end.time == 0);
  task.event_values = NULL;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_BAD_ARGUMENT && strstr(ksl_error_message(), "events"));
  task.events_n = 0, task.method = KSL_RK4, task.step = 0.01, task.after_step = count, task.step_context = &steps;
  CHECK(ksl_simulate(m, &task, NULL, NULL, &out) == KSL_OK && end.how == KSL_STOPPED && steps == 3);
  CHECK(fabs(end.time - 0.03) < 1e-12);
  ksl_model_free(m);
}

int main(void) {
  test_period();
  test_brake();
  test_events();
  return exit_status();
}
