// What XML demands and pugixml doesn't: references that are known, characters that are allowed, no attribute twice. And
// limits.
#pragma once

#include <pugixml.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace ksl::text {

/// A fault in a text, by which it is no robot file.
struct markup_fault {
  std::size_t offset; ///< of the first byte
  std::string what;
};

/// What is found in a text before it is parsed.
struct markup {
  std::size_t elements = 0;            ///< how many begin in it; counted up to one more than there may be
  std::optional<markup_fault> doctype; ///< the text isn't looked at beyond it
  /// The first reference or character that XML forbids.  A text that isn't well-formed has a better message.
  std::optional<markup_fault> fault;
};

/// Looks at a text in UTF-8, once.
markup look_at(std::string_view text);

/// What is wrong with an element.
struct element_fault {
  pugi::xml_node at;
  std::string what;
};

/// The first element that is too deep or too long, or that has too many attributes or one of them twice.  Linear in the
/// document.
std::optional<element_fault> fault_in_elements(const pugi::xml_document &document);

} // namespace ksl::text
