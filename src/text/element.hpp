// An element of a robot file: access to its children and numbers, and checks for unknown content.
#pragma once

#include "text/unused.hpp"
#include "text/xml.hpp"

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ksl::text {

/// An element inside a link, a joint or the robot (`where`).  Every error names the file, the line and `where`.
class element {
public:
  element(const xml_file &file, unused_list &unused, pugi::xml_node node, owner where)
      : file_(&file), unused_(&unused), node_(node), where_(std::move(where)) {}

  explicit operator bool() const { return static_cast<bool>(node_); }
  std::string tag() const { return node_.name(); }
  int line() const { return file_->line_of(node_); }
  pugi::xml_node node() const { return node_; }
  const owner &where() const { return where_; }

  /// The child of that tag; false when there is none, an error when there are two.
  element child(const char *tag) const;

  /// Lists attributes and child elements other than those named.
  void expect(std::initializer_list<std::string_view> attributes,
              std::initializer_list<std::string_view> children) const;

  bool has(const char *attribute) const { return static_cast<bool>(node_.attribute(attribute)); }
  std::string text(const char *attribute) const { return node_.attribute(attribute).value(); }

  /// The number in an attribute; empty if there is no such attribute.
  std::optional<double> number(const char *attribute) const;
  /// The number in an attribute that is required; `mend` tells the user what to do if it is missing.
  double required_number(const char *attribute, const std::string &mend) const;
  /// The N numbers in an attribute that is present.
  template <std::size_t N> std::array<double, N> numbers(const char *attribute) const {
    std::array<double, N> values{};
    read_numbers(attribute, values.data(), N);
    return values;
  }

  /// For elements that hold text: lists attributes other than those named, and child elements.
  void expect_text(std::initializer_list<std::string_view> attributes) const;
  /// The element's text, without blanks around it.
  std::string content() const;
  /// The numbers in it; `example` shows what to write if there is none, or not as many as wanted.
  std::vector<double> content_numbers(std::size_t count, const std::string &example) const;

  [[noreturn]] void refuse(const std::string &what) const;

private:
  void expect_attributes(std::initializer_list<std::string_view> attributes) const;
  void read_numbers(const char *attribute, double *values, std::size_t count) const;
  double number_from(const char *attribute, std::string_view word) const;

  const xml_file *file_;
  unused_list *unused_;
  pugi::xml_node node_;
  owner where_;
};

} // namespace ksl::text
