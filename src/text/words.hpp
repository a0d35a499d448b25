// Text helpers for the readers of files: messages, lists of names, and numbers independent of the locale.
#pragma once

#include "text/characters.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ksl::text {

/// Throws description_error with "file:line: what", as one printable line.  A file that is empty or a line that is 0 is
/// not known and left out.  Whatever the file holds, the message is short: names and values are to be quoted or listed,
/// and of a message that would still be long, the middle is left out.
[[noreturn]] void refuse(const std::string &file, int line, const std::string &what);

/// " (line 12)", or an empty text if no line is known.
std::string in_line(int line);

/// The text in double quotes, printable, shortened if it is long.
std::string quoted(std::string_view text);

/// "a, b, c", or the first names and "and 7 more".  Long names are shortened.
std::string listed(const std::vector<std::string> &names, std::size_t most = 6);

/// A number with six significant digits and a decimal point, whatever the locale.
std::string shown(double number);

/// The double nearest to the number in a text that contains nothing else, except blanks around it and a leading plus.
/// The double of 1e-400 is 0. Empty if there is no number, or if it is infinite or beyond the largest double.
std::optional<double> number_in(std::string_view text);

/// Why there is no number in a text, as the end of a sentence.
std::string number_fault(std::string_view text);

/// The text without blanks around it.
std::string_view trimmed(std::string_view text);

/// Splits a text at blanks.
std::vector<std::string_view> split(std::string_view text);

/// The candidate that differs from `name` by one or two typing errors; empty if there is none.
std::string nearest(std::string_view name, const std::vector<std::string> &candidates);

/// `; did you mean "base_link"?`, or `otherwise` when no candidate is near.
std::string suggestion(std::string_view name, const std::vector<std::string> &candidates, const std::string &otherwise);

/// Has one of these links or joints the name?
template <class Items> bool has_name(const Items &items, std::string_view name) {
  return std::any_of(items.begin(), items.end(), [&](const auto &item) { return item.name == name; });
}

/// A name that is not taken: this one, or with underscores after it.
template <class Taken> std::string free_name(std::string name, Taken &&is_taken) {
  while (is_taken(name))
    name += '_';
  return name;
}

} // namespace ksl::text
