#include "engine/loops/converted_plan.hpp"
#include "engine/loops/plan.hpp"
#include "ksl/engine/algorithms/loops/tolerances.hpp"

#include <algorithm>

namespace ksl::loops {

std::shared_ptr<const loop_plan<float>> rounded(const loop_plan<double> &plan) {
  const std::shared_ptr<loop_plan<float>> made = std::make_shared<loop_plan<float>>();
  convert(plan, *made);
  made->view.tolerance = static_cast<float>(std::max(loop_tolerance::accepted_single, plan.view.tolerance));
  return made;
}

} // namespace ksl::loops
