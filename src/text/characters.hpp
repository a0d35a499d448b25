// Characters of UTF-8 text: how long they are, which of them XML forbids, and texts as messages may show them.
#pragma once

#include <string>
#include <string_view>

namespace ksl::text {

/// A character: its number, and its length in bytes, which is 0 if no UTF-8 character begins there.
struct character {
  char32_t code = 0;
  std::size_t bytes = 0;
};

/// The first character of a text that isn't empty.  Truncated and overlong ones and surrogates are invalid.
character first_character(std::string_view text);

/// Appends a character as UTF-8.
void append_utf8(std::string &text, char32_t c);

/// May a file contain it?  XML 1.0, production 2.
bool is_allowed_in_xml(char32_t c);

/// The text as one line that a terminal shows as it is: blanks stay blanks, and what would move the cursor, turn the
/// order of letters or is no UTF-8 is written as \x1b, \u202e or \xff.
std::string printable(std::string_view text);

/// The text if it is no longer than `most` bytes, otherwise its beginning, whole characters, and "...".
std::string shortened(std::string_view text, std::size_t most);

/// The text if it is no longer than `most` bytes, otherwise its beginning, "..." and its end.
std::string shortened_in_middle(std::string_view text, std::size_t most);

} // namespace ksl::text
