// What the targets share: a text becomes a model, or is refused with a sentence, and either is checked.
#pragma once

#include "ksl/model.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace ksl::fuzz {

/// Ends the process with a report, so that libFuzzer keeps the text.
[[noreturn]] void broken(const std::string &promise, const std::string &detail);

/// The model of a robot file's contents; empty if they are refused.  Options follow from the text itself, so that each
/// text always takes the same way.  Checked are, of what is refused: the kind of the exception, and its message; of
/// what is loaded: that names are unique, and all numbers finite; of both: time.
std::optional<model> loaded(const std::uint8_t *bytes, std::size_t size);

} // namespace ksl::fuzz
