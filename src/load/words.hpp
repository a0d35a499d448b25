// Words and numbers that the readers of files share: messages, lists of names, numbers independent of the locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ksl::load {

/// Throws description_error with "file:line: what", as far as file and line are known (empty, 0).
[[noreturn]] void refuse(const std::string &file, int line, const std::string &what);

/// " (line 12)", or nothing where no line is known.
std::string in_line(int line);

/// The text with control characters replaced by spaces, so that a message stays one line.
std::string one_line(std::string text);

/// The text in double quotes, on one line, shortened where it is long.
std::string quoted(std::string_view text);

/// "a, b, c", or the first names and "and 7 more".
std::string listed(const std::vector<std::string> &names, std::size_t most = 6);

/// A number with six significant digits and a decimal point, whatever the locale.
std::string shown(double number);

/// The finite number that the text holds, and nothing else but blanks around it and a leading plus.
std::optional<double> number_in(std::string_view text);

/// The words between blanks.
std::vector<std::string_view> split(std::string_view text);

/// The candidate that differs from `name` by a slip of the pen or two; empty when there is none.
std::string nearest(std::string_view name, const std::vector<std::string> &candidates);

/// `; did you mean "base_link"?`, or `otherwise` when no candidate is near.
std::string suggestion(std::string_view name, const std::vector<std::string> &candidates, const std::string &otherwise);

} // namespace ksl::load
