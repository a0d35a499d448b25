#include "text/words.hpp"

#include "ksl/engine/model/description_error.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <system_error>
#include <utility>

namespace ksl::text {

namespace {

constexpr std::string_view blanks = " \t\r\n";

/// Levenshtein distance: how many letters must be changed, inserted or deleted to turn a into b.  Distances of `most`
/// or more may be given as larger than they are: then only letters at most that far from each other are compared, in
/// time that grows with the length alone.
///
///     d(i, j) = min(d(i − 1, j − 1) + [a_i ≠ b_j],  d(i, j − 1) + 1,  d(i − 1, j) + 1),    |i − j| ≤ most
///
/// row by row; `row` is row i, `above` row i − 1.  Elements off that band count as `most`.
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t most) {
  std::vector<std::size_t> row(b.size() + 1), above(b.size() + 1);
  std::iota(above.begin(), above.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    const std::size_t first = i > most ? i - most : 1, last = std::min(b.size(), i + most);
    row[first - 1] = first == 1 ? i : most;
    std::size_t least = row[first - 1];
    for (std::size_t j = first; j <= last; ++j) {
      const std::size_t inserted = j == i + most ? most : above[j]; // above[j] is beyond the letters that were compared
      row[j] = std::min({above[j - 1] + (a[i - 1] != b[j - 1]), row[j - 1] + 1, inserted + 1});
      least = std::min(least, row[j]);
    }
    if (least >= most)
      return most;
    std::swap(row, above);
  }
  return above[b.size()];
}

/// A decimal number too large or too small for a double: is it the latter?  By the power of ten of its first digit that
/// isn't zero, which it has, since zeros are read whatever their exponents.
bool is_below_least_double(std::string_view text) {
  constexpr long most = 1'000'000'000; // more digits or a larger exponent make no difference
  const std::size_t e = text.find_first_of("eE");
  const std::string_view digits = text.substr(0, e);
  const std::size_t point = std::min(digits.find('.'), digits.size()), first = digits.find_first_of("123456789");
  long power = first < point ? static_cast<long>(point - first) : -static_cast<long>(first - point);
  if (e != text.npos) {
    std::string_view exponent = text.substr(e + 1);
    const bool negative = exponent[0] == '-';
    if (exponent[0] == '-' || exponent[0] == '+')
      exponent.remove_prefix(1);
    long size = 0;
    for (const char digit : exponent)
      size = std::min(most, 10 * size + (digit - '0'));
    power += negative ? -size : size;
  }
  return power < 0;
}

/// The status and the number of std::from_chars for a text that holds a number and nothing else; invalid_argument for
/// any other.
/// One sign + is passed over, which from_chars doesn't take; "inf", "nan" and numbers beyond a double are none.
std::pair<std::errc, double> read_number(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);
  double number = 0;
  const char *const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, number);
  if (stop != end || (status == std::errc() && !std::isfinite(number)))
    return {std::errc::invalid_argument, 0};
  if (status == std::errc::result_out_of_range && is_below_least_double(text))
    return {std::errc(), text[0] == '-' ? -0.0 : 0.0};
  return {status, number};
}

} // namespace

void refuse(const std::string &file, int line, const std::string &what) {
  constexpr std::size_t most_of_path = 1000, most = 4000;
  std::string where = shortened_in_middle(printable(file), most_of_path);
  if (line > 0)
    where += (file.empty() ? "line " : ":") + std::to_string(line);
  throw description_error((where.empty() ? "" : where + ": ") + shortened_in_middle(printable(what), most));
}

std::string in_line(int line) { return line > 0 ? " (line " + std::to_string(line) + ")" : std::string(); }

std::string quoted(std::string_view text) {
  constexpr std::size_t most = 60;
  return '"' + printable(shortened(text, most)) + '"';
}

std::string listed(const std::vector<std::string> &names, std::size_t most) {
  constexpr std::size_t most_of_name = 100;
  // "and 1 more" would be no shorter than the name itself
  const std::size_t count = names.size() <= most + 1 ? names.size() : most;
  std::string list;
  for (std::size_t i = 0; i < count; ++i)
    list += (i > 0 ? ", " : "") + shortened(names[i], most_of_name);
  if (count < names.size())
    list += " and " + std::to_string(names.size() - count) + " more";
  return list;
}

std::string shown(double number) {
  char digits[40];
  const auto end = std::to_chars(digits, digits + sizeof digits, number, std::chars_format::general, 6).ptr;
  return std::string(digits, end);
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == text.npos)
    return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::optional<double> number_in(std::string_view text) {
  const auto [status, number] = read_number(text);
  return status == std::errc() ? std::optional(number) : std::nullopt;
}

std::string number_fault(std::string_view text) {
  return read_number(text).first == std::errc::result_out_of_range ? "which is beyond the largest double, 1.8e308"
                                                                   : "not a finite number";
}

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> words;
  for (auto first = text.find_first_not_of(blanks); first != text.npos; first = text.find_first_not_of(blanks)) {
    text.remove_prefix(first);
    words.push_back(text.substr(0, text.find_first_of(blanks)));
    text.remove_prefix(words.back().size());
  }
  return words;
}

std::string nearest(std::string_view name, const std::vector<std::string> &candidates) {
  std::string best;
  // up to a quarter of its letters, 1 to 3 of them, may be wrong; beyond, it is another name
  std::size_t least = 1 + std::clamp<std::size_t>(name.size() / 4, 1, 3);
  for (const std::string &candidate : candidates) {
    const std::size_t gap = std::max(name.size(), candidate.size()) - std::min(name.size(), candidate.size());
    if (gap >= least)
      continue;
    const std::size_t distance = edit_distance(name, candidate, least);
    if (distance < least)
      least = distance, best = candidate;
  }
  return best;
}

std::string suggestion(std::string_view name, const std::vector<std::string> &candidates,
                       const std::string &otherwise) {
  const std::string near = nearest(name, candidates);
  return near.empty() ? "; " + otherwise : "; did you mean " + text::quoted(near) + "?"; // not std::quoted
}

} // namespace ksl::text
