// An XML file with line numbers.  pugixml parses it; this adds lines, encodings, and errors that pugixml doesn't report.
#pragma once

#include <pugixml.hpp>

#include <string>
#include <vector>

namespace ksl::text {

/// A parsed XML document that knows the line of each element.
class xml_file {
public:
  /// Parses the text; `name` stands for the file in messages.  Throws description_error unless it is well-formed XML
  /// with one root element, without DOCTYPE, and within the limits of limits.hpp.
  xml_file(std::string text, std::string name);

  pugi::xml_node root() const { return document_.document_element(); }
  int line_of(pugi::xml_node node) const;
  const std::string &name() const { return name_; }

  /// Throws description_error with the file, the line of the node, and what is wrong.
  [[noreturn]] void refuse(pugi::xml_node at, const std::string &what) const;

  /// A warning if the encoding had to be guessed, otherwise empty.
  const std::string &guessed_encoding() const { return guessed_encoding_; }

private:
  void decode();
  void check_outside_of_root() const;
  int line_at(std::size_t offset) const;

  std::string text_; ///< UTF-8
  std::string name_;
  std::string guessed_encoding_;
  std::vector<std::size_t> line_starts_; ///< offset of the first byte of each line
  pugi::xml_document document_;
};

/// Refuses one more link or joint than a file may have; `count` were before it.
void check_count(const xml_file &file, pugi::xml_node at, std::size_t count, std::size_t most, const char *what);

} // namespace ksl::text
