// Records an algorithm on one mechanism.
//
//     row and model ──record()──→ graph, inputs, results ──→ python/ksl/generation: C, CUDA and other languages
//                        │
//                        └─ the engine's own templates, with `recording` for the scalar: no algorithm is written twice
//
// What is recorded is one path through an algorithm: the tree, the kinds of joints and the pivots of loops are those of this model.
#pragma once

#include "generate/recorded.hpp"
#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/engine/steps/reaction_request.hpp"
#include "ksl/model.hpp"

#include <string>
#include <vector>

namespace ksl::generate {

/// What a call asks for besides numbers, and which numbers of the model are inputs.
struct request {
  std::string row;
  std::vector<int> links; ///< of requests for links
  frame_options frame = {};
  reaction_request joints = {};     ///< of requests for joints; `link` is good for the call
  std::vector<int> external_links;  ///< on which wrenches act
  bool gravity = false;             ///< is gravity an input
  std::vector<int> payload_links;   ///< that carry a payload whose ten numbers are inputs
  std::vector<int> parameter_links; ///< whose own ten numbers are inputs, each link once
  bool pivots = false;              ///< are the sizes of the pivots of closed mechanisms a further result, `pivots`
  bool single = false;              ///< in single precision
};

/// Inputs come in the order of calls: those of the row, then 6 numbers of each wrench, gravity, 10 numbers of each payload, 10 of each link's parameters.
/// Throws std::invalid_argument for a row that doesn't exist, or that isn't computed for the model by fixed steps; std::out_of_range for a link that
/// doesn't exist; recording_error.
recorded record(const model &, const request &);

} // namespace ksl::generate
