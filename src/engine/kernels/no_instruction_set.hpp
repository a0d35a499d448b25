// The sentence about a processor for which a library has no code.
#pragma once

#include <string>

namespace ksl {

/// built: the sets that the library has, "x86-64-v4, x86-64-v3" say; here: the best set of this processor, empty if it is older than all.
inline std::string no_instruction_set_text(const std::string &built, const std::string &here) {
  if (here.empty())
    return "this processor is older than x86-64-v2; build KSL from source for it";
  return "this library has code for " + built + " alone, and this processor is " + here +
         "; take a library for all processors, or build KSL here, with -DKSL_INSTRUCTION_SETS=native";
}

} // namespace ksl
