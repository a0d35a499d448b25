// The plan of a closed mechanism's elimination is made at a closed position, which kernels compute.  What is fuzzed reads
// and writes models and computes nothing, so it has no kernels, models without plans, and frames of loops as files have them.
#include "engine/loops/exact_frames.hpp"
#include "engine/loops/idle_bodies.hpp"
#include "engine/loops/plan.hpp"

namespace ksl::loops {

std::vector<double> regular_position(const model & /*m*/) { return {}; }
std::vector<idle_body> bodies_that_turn_alone(const model & /*m*/, const std::vector<double> & /*q*/) { return {}; }
void keep(std::vector<idle_body> /*bodies*/, tables & /*t*/) {}
std::shared_ptr<const loop_plan<double>> make_plan(const model & /*m*/, const std::vector<double> & /*q*/) {
  return nullptr;
}
std::shared_ptr<const loop_plan<float>> rounded(const loop_plan<double> & /*plan*/) { return nullptr; }
frame_fit fit_frames(const model & /*m*/, tables /*t*/, robot_description & /*robot*/) { return {}; }

} // namespace ksl::loops
