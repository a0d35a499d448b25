#include "text/characters.hpp"

namespace ksl::text {

namespace {

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

/// Control characters, and format characters that turn the order of letters or end a line (Unicode's Bidi_Control,
/// U+2028, U+2029).
bool must_be_escaped(char32_t c) {
  const bool control = c < 0x20 || (c >= 0x7f && c < 0xa0);
  const bool turns =
      c == 0x61c || c == 0x200e || c == 0x200f || (c >= 0x2028 && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069);
  return control || turns || !is_allowed_in_xml(c);
}

/// "\x1b", "\u202e".
std::string escaped(char32_t c, const char *prefix, int digits) {
  std::string text = prefix;
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4)
    text += "0123456789abcdef"[c >> shift & 0xf];
  return text;
}

} // namespace

// RFC 3629, section 3:
//
//     U+0000  – U+007F      0xxxxxxx
//     U+0080  – U+07FF      110xxxxx 10xxxxxx                         first byte c2 – df: c0 and c1 would be overlong
//     U+0800  – U+FFFF      1110xxxx 10xxxxxx 10xxxxxx                without surrogates, U+D800 – U+DFFF
//     U+10000 – U+10FFFF    11110xxx 10xxxxxx 10xxxxxx 10xxxxxx       first byte f0 – f4
character first_character(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80)
    return {first, 1};
  const std::size_t length = first >= 0xc2 && first < 0xe0   ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (length == 0 || text.size() < length)
    return {};
  char32_t code = first & (0xffu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if (!continues_character(text[i]))
      return {};
    code = code << 6 | (byte(i) & 0x3fu);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return overlong || surrogate || code > 0x10ffff ? character{} : character{code, length};
}

void append_utf8(std::string &text, char32_t c) {
  const auto byte = [&text](char32_t value) { text += static_cast<char>(static_cast<unsigned char>(value)); };
  if (c < 0x80) {
    byte(c);
  } else if (c < 0x800) {
    byte(0xc0 | (c >> 6)), byte(0x80 | (c & 0x3f));
  } else if (c < 0x10000) {
    byte(0xe0 | (c >> 12)), byte(0x80 | ((c >> 6) & 0x3f)), byte(0x80 | (c & 0x3f));
  } else {
    byte(0xf0 | (c >> 18)), byte(0x80 | ((c >> 12) & 0x3f)), byte(0x80 | ((c >> 6) & 0x3f)), byte(0x80 | (c & 0x3f));
  }
}

bool is_allowed_in_xml(char32_t c) {
  return c == '\t' || c == '\n' || c == '\r' || (c >= 0x20 && c < 0xd800) || (c >= 0xe000 && c < 0xfffe) ||
         (c >= 0x10000 && c < 0x110000);
}

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const auto [code, bytes] = first_character(text);
    if (bytes == 0)
      shown += escaped(static_cast<unsigned char>(text[0]), "\\x", 2);
    else if (code == '\t' || code == '\n' || code == '\r')
      shown += ' ';
    else if (must_be_escaped(code))
      shown += code < 0x80 ? escaped(code, "\\x", 2) : escaped(code, "\\u", 4);
    else
      shown += text.substr(0, bytes);
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return shown;
}

std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most)
    return std::string(text);
  std::size_t end = most;
  while (end > 0 && continues_character(text[end]))
    --end;
  return std::string(text.substr(0, end)) + "...";
}

std::string shortened_in_middle(std::string_view text, std::size_t most) {
  if (text.size() <= most)
    return std::string(text);
  std::size_t start = text.size() - most / 2;
  while (start < text.size() && continues_character(text[start]))
    ++start;
  return shortened(text, most / 2) + std::string(text.substr(start));
}

} // namespace ksl::text
