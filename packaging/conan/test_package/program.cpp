#include <ksl/dynamics.hpp>
#include <cstdio>
#include <vector>

int main(int, char **argv) {
  ksl::model m = ksl::load(argv[1]);
  ksl::data d(m);
  std::vector<double> q(m.nq()), tau(m.nv());
  ksl::gravity_torque(m, d, q.data(), tau.data());
  std::printf("%s: %d joints, %.2f N m\n", ksl::instruction_set(), m.moving_joints(), tau[1]);
}
