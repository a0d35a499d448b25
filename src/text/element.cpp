#include "text/element.hpp"

#include "text/words.hpp"

#include <algorithm>

namespace ksl::text {

namespace {

bool among(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_namespace(std::string_view attribute) { return attribute == "xmlns" || attribute.substr(0, 6) == "xmlns:"; }

/// How to mend a word that should be a number, by what it looks like.
/// Letters besides e and E are a unit, or a word, of which there is more to say than that characters only look like digits.
std::string mend_of(std::string_view word) {
  if (word.find('$') != word.npos)
    return "this is a xacro expression: run xacro on the file first";
  if (word.find(',') != word.npos)
    return "write a point for the decimals and blanks between numbers";
  const bool is_ascii =
      std::none_of(word.begin(), word.end(), [](char c) { return static_cast<unsigned char>(c) > 127; });
  if (!is_ascii && word.find_first_of("abcdfghijklmnopqrstuvwxyzABCDFGHIJKLMNOPQRSTUVWXYZ") == word.npos) // no unit
    return "it holds a character that only looks like a blank, a sign or a digit: type it again";
  return "write a finite decimal number such as 0.25 or 1e-3";
}

/// A word that should be a number, what is wrong with it, and how to mend it.
std::string fault_of(std::string_view word) { return quoted(word) + ", " + number_fault(word) + "; " + mend_of(word); }

} // namespace

element element::child(const char *tag) const {
  const pugi::xml_node first = node_.child(tag);
  if (const pugi::xml_node second = first.next_sibling(tag))
    file_->refuse(second, where_.words() + ": a second <" + tag + "> in <" + node_.name() + ">, the first is in line " +
                              std::to_string(file_->line_of(first)) + "; keep one of them");
  return {*file_, *unused_, first, where_};
}

void element::expect_attributes(std::initializer_list<std::string_view> attributes) const {
  for (const pugi::xml_attribute attribute : node_.attributes()) {
    const std::string name = attribute.name();
    if (!among(name, attributes) && !is_namespace(name))
      unused_->unknown_attribute(attribute, node_, where_, line());
  }
}

/// What isn't expected is listed, not refused: readers judge afterwards whether it would have joined links (unread.hpp).
void element::expect(std::initializer_list<std::string_view> attributes,
                     std::initializer_list<std::string_view> children) const {
  expect_attributes(attributes);
  for (const pugi::xml_node child : node_.children()) {
    if (child.type() != pugi::node_element)
      unused_->text(tag(), where_, file_->line_of(child));
    else if (!among(child.name(), children))
      unused_->unknown_element(child, where_, file_->line_of(child));
  }
}

void element::expect_text(std::initializer_list<std::string_view> attributes) const {
  expect_attributes(attributes);
  for (const pugi::xml_node child : node_.children())
    if (child.type() == pugi::node_element)
      unused_->unknown_element(child, where_, file_->line_of(child));
}

std::string element::content() const { return std::string(trimmed(node_.child_value())); }

std::vector<double> element::content_numbers(std::size_t count, const std::string &example) const {
  const std::string all = content();
  std::vector<double> values;
  for (const std::string_view word : split(all)) {
    const auto value = number_in(word);
    if (!value)
      refuse("<" + tag() + "> holds " + fault_of(word));
    values.push_back(*value);
  }
  if (values.size() != count)
    refuse("<" + tag() + "> needs " + std::to_string(count) + (count == 1 ? " number" : " numbers") + ", found " +
           std::to_string(values.size()) + "; write <" + tag() + ">" + example + "</" + tag() + "> for example");
  return values;
}

std::optional<double> element::number(const char *attribute) const {
  if (!has(attribute))
    return std::nullopt;
  return numbers<1>(attribute)[0];
}

double element::required_number(const char *attribute, const std::string &mend) const {
  if (!has(attribute))
    refuse("<" + tag() + "> has no " + attribute + "; " + mend);
  return *number(attribute);
}

void element::read_numbers(const char *attribute, double *values, std::size_t count) const {
  const std::string all = text(attribute);
  const auto words = split(all);
  // a word that is not a number is a more useful message than a wrong count
  for (std::size_t i = 0; i < words.size(); ++i) {
    const double value = number_from(attribute, words[i]);
    if (i < count)
      values[i] = value;
  }
  if (words.size() != count)
    refuse("<" + tag() + "> " + attribute + " needs " + std::to_string(count) + (count == 1 ? " number" : " numbers") +
           ", found " + std::to_string(words.size()) + "; write " + attribute + "=\"" +
           (count == 1   ? "0.5"
            : count == 3 ? "0 0 0.5"
                         : "0 0 0 1") +
           "\" for example");
}

double element::number_from(const char *attribute, std::string_view word) const {
  const auto value = number_in(word);
  if (!value)
    refuse("<" + tag() + "> " + attribute + " holds " + fault_of(word));
  return *value;
}

void element::refuse(const std::string &what) const { file_->refuse(node_, where_.words() + ": " + what); }

} // namespace ksl::text
