// Frames as types: what mixes them up does not compile, and costs nothing when it runs.
//
//   c++ -std=c++20 -Iinclude examples/cpp/frames.cpp && ./a.out
#include <ksl/spatial.hpp>

#include <cstdio>

struct world;
struct drum;

int main() {
  // a winch's drum, 2 m up, turns about the world's y axis; a rope leaves it at its rim and carries 50 kg
  const ksl::pose<double, world, drum> X({1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 2}); // R by columns, t
  const ksl::twist<double, drum> turning({0, 0, 0}, {0, 0.5, 0});                 // linear, angular: rad/s
  const double radius = 0.2, weight = 50 * 9.81;
  const ksl::wrench<double, drum> rope({0, 0, -weight}, {0, radius * weight, 0}); // force, moment about the drum's axis

  std::printf("power of the rope: %.3f W, seen from the world: %.3f W\n", dot(rope, turning),
              dot(X * rope, X * turning));
  const ksl::wrench<double, world> seen = X * rope;
  std::printf("about the world's origin: moment %.3f N m\n", seen.ang.y);
  // X * X, dot(X * rope, turning), rope + turning, X.inverse() * turning: none of these compiles
}
