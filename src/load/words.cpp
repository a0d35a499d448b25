#include "load/words.hpp"

#include "ksl/engine/description.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace ksl::load {

namespace {

constexpr std::string_view blanks = " \t\r\n";

/// Levenshtein distance: how many letters must be changed, inserted or deleted to turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

} // namespace

void refuse(const std::string &file, int line, const std::string &what) {
  std::string where = file;
  if (line > 0)
    where += (file.empty() ? "line " : ":") + std::to_string(line);
  throw description_error(one_line(where.empty() ? what : where + ": " + what));
}

std::string in_line(int line) { return line > 0 ? " (line " + std::to_string(line) + ")" : std::string(); }

std::string one_line(std::string text) {
  for (char &c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      c = ' ';
  return text;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t most = 60;
  std::string shorter(text.substr(0, most));
  if (text.size() > most) {
    // do not cut a UTF-8 character in two
    std::size_t end = most;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80)
      --end;
    shorter = std::string(text.substr(0, end)) + "...";
  }
  return '"' + one_line(shorter) + '"';
}

std::string listed(const std::vector<std::string> &names, std::size_t most) {
  // "and 1 more" would be no shorter than the name itself
  const std::size_t count = names.size() <= most + 1 ? names.size() : most;
  std::string list;
  for (std::size_t i = 0; i < count; ++i)
    list += (i > 0 ? ", " : "") + names[i];
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
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);
  double number = 0;
  const char *const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, number);
  if (status != std::errc() || stop != end || !std::isfinite(number))
    return std::nullopt;
  return number;
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
  std::size_t least = 1 + std::clamp<std::size_t>(name.size() / 4, 1, 3);
  for (const std::string &candidate : candidates) {
    const std::size_t gap = std::max(name.size(), candidate.size()) - std::min(name.size(), candidate.size());
    if (gap >= least)
      continue;
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < least)
      least = distance, best = candidate;
  }
  return best;
}

std::string suggestion(std::string_view name, const std::vector<std::string> &candidates,
                       const std::string &otherwise) {
  const std::string near = nearest(name, candidates);
  return near.empty() ? "; " + otherwise : "; did you mean " + quoted(near) + "?";
}

} // namespace ksl::load
