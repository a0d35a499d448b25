// What a robot file may have at most.  Robots that people build are far below; beyond, memory or time would be the
// limit.  docs/models.md has the same table.
#pragma once

#include <cstddef>

namespace ksl::text::limits {

inline constexpr std::size_t file_bytes = 64u << 20;
inline constexpr std::size_t elements = 1'000'000;
inline constexpr std::size_t depth = 100;            ///< of elements in elements, the root included
inline constexpr std::size_t attributes = 1'000;     ///< of one element
inline constexpr std::size_t value_bytes = 1u << 20; ///< of an attribute, or of a text between tags
inline constexpr std::size_t name_bytes = 1'000;     ///< of elements, attributes, links, joints, frames and models
inline constexpr std::size_t links = 100'000;
inline constexpr std::size_t joints = 100'000;
/// Velocities of a model, those of mimic joints included.  The mass matrix has the square of that in elements, which an
/// int counts.
inline constexpr std::size_t coordinates = 40'000;

} // namespace ksl::text::limits
