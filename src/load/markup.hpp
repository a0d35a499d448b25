// What XML demands and pugixml doesn't: references that are known, characters that are allowed, no attribute twice. And
// limits.
#pragma once

#include <pugixml.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace ksl::load {

/// Something in a text that makes it no robot file.
struct markup_fault {
  std::size_t offset; ///< of the first byte
  std::string what;
};

/// What a text says about itself before it is parsed.
struct markup {
  std::size_t elements = 0;            ///< how many begin in it; counted up to one more than there may be
  std::optional<markup_fault> doctype; ///< the text isn't looked at beyond it
  std::optional<markup_fault>
      fault; ///< the first reference or character that XML forbids, if the text is otherwise well-formed
};

/// Looks at a text in UTF-8, once.
markup look_at(std::string_view text);

/// What is wrong with one of the elements of a document: too deep, too long, too many attributes, or one of them twice.
struct element_fault {
  pugi::xml_node at;
  std::string what;
};
std::optional<element_fault> fault_in_elements(const pugi::xml_document &document);

} // namespace ksl::load
