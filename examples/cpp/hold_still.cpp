// Motor torques that hold a robot at rest, and the wrench on the bolts of its base.
//
// Where the library has been built in build/release, as README says:
//
//   c++ -std=c++20 -Iinclude examples/cpp/hold_still.cpp -Lbuild/release -Wl,-rpath,build/release -lksl
//   ./a.out examples/robots/ur5.urdf
#include <ksl/dynamics.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <vector>

int main(int argc, char **argv) try {
  const ksl::model robot = ksl::load(argc > 1 ? argv[1] : "examples/robots/ur5.urdf");
  ksl::data data(robot); // one for each thread
  const std::vector<double> q(robot.nq(), 0.5), zero(robot.nv(), 0.0);
  std::vector<double> tau(robot.nv());
  ksl::inverse_dynamics(robot, data, q.data(), zero.data(), zero.data(), tau.data());
  for (int i = 0; i < robot.moving_joints(); ++i)
    std::printf("%-22s %9.4f N m\n", robot.joints()[i].name.c_str(), tau[robot.joints()[i].v_index]);

  // what the ground exerts on the root, at its origin: `base` is the last of the joints
  const int base = robot.joints().back().link;
  ksl::reaction_request request;
  request.n = 1;
  request.link = &base;
  double f[6];
  ksl::reactions(robot, data, request, f);
  std::printf("%-22s %9.4f N and a moment of %.4f N m\n", "base", std::hypot(f[0], f[1], f[2]),
              std::hypot(f[3], f[4], f[5]));
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
