#include "text/xml.hpp"

#include "text/limits.hpp"
#include "text/markup.hpp"
#include "text/regular_file.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <new>
#include <string_view>

namespace ksl::text {

namespace {

/// Converts UTF-16 to UTF-8; invalid code units become U+FFFD.
std::string utf8_from_utf16(std::string_view bytes, bool big_endian) {
  const auto unit = [&](std::size_t i) -> char32_t {
    const auto first = static_cast<unsigned char>(bytes[i]), second = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<char32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    // a high surrogate and a low one are a character beyond U+FFFF, ten bits from each
    char32_t c = unit(i);
    const char32_t low = i + 3 < bytes.size() ? unit(i + 2) : 0;
    if (c >= 0xd800 && c < 0xdc00 && low >= 0xdc00 && low < 0xe000) {
      c = 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00);
      i += 2;
    } else if (c >= 0xd800 && c < 0xe000) {
      c = 0xfffd;
    }
    append_utf8(text, c);
  }
  if (bytes.size() % 2 != 0)
    append_utf8(text, 0xfffd);
  return text;
}

std::string utf8_from_latin1(std::string_view bytes) {
  std::string text;
  for (const char c : bytes)
    append_utf8(text, static_cast<unsigned char>(c));
  return text;
}

std::size_t first_not_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = first_character(text.substr(i)).bytes;
    if (length == 0)
      return i;
    i += length;
  }
  return text.npos;
}

/// A line ends with \n, \r\n or \r alone, as XML counts them.
std::vector<std::size_t> starts_of_lines(std::string_view text) {
  std::vector<std::size_t> starts = {0};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool lone_return = text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n');
    if (text[i] == '\n' || lone_return)
      starts.push_back(i + 1);
  }
  return starts;
}

/// pugixml's description of an error, as part of a sentence.
std::string reason(const pugi::xml_parse_result &result) {
  std::string words = result.description();
  if (!words.empty() && words[0] >= 'A' && words[0] <= 'Z')
    words[0] = static_cast<char>(words[0] - 'A' + 'a');
  return words;
}

/// "<robot>".
std::string quoted_tag(pugi::xml_node node) { return "<" + shortened(node.name(), 100) + ">"; }

} // namespace

xml_file::xml_file(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) {
  // First what pugixml would pass over, or need too much memory for: a zero byte, too many elements, a DOCTYPE.  Then pugixml's own errors, whose messages
  // are better than those about a reference or a character, which come last.
  if (text_.empty())
    text::refuse(name_, 0, "the file is empty, expected a <robot> element; give a URDF file");
  check_size(text_.size(), name_);
  decode();
  line_starts_ = starts_of_lines(text_);
  // a zero byte would end the text without an error
  if (const auto zero = text_.find('\0'); zero != text_.npos)
    text::refuse(name_, line_at(zero), "a zero byte, so this is no text file; save it as UTF-8 text");
  const markup found = look_at(text_);
  if (found.elements > limits::elements)
    text::refuse(name_, 0,
                 "the file has more than " + std::to_string(limits::elements) +
                     " elements; split it, or leave out what is no link or joint");
  if (found.doctype)
    text::refuse(name_, line_at(found.doctype->offset), found.doctype->what);

  // as a fragment: pugixml would drop text outside of the root element, and accepts several of these
  const auto result = document_.load_buffer(text_.data(), text_.size(), pugi::parse_default | pugi::parse_fragment,
                                            pugi::encoding_utf8);
  if (result.status == pugi::status_out_of_memory)
    throw std::bad_alloc();
  if (result && !root())
    text::refuse(name_, 0, "the file holds no XML element, expected <robot>; give a URDF file");
  if (!result)
    text::refuse(name_, line_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))),
                 "broken XML, " + reason(result) + "; correct it here, or close the tag that was opened above");
  if (found.fault)
    text::refuse(name_, line_at(found.fault->offset), found.fault->what);
  if (const auto fault = fault_in_elements(document_))
    refuse(fault->at, fault->what);
  check_outside_of_root();
}

void xml_file::check_outside_of_root() const {
  for (const pugi::xml_node other : document_.children()) {
    if (other.type() == pugi::node_pcdata || other.type() == pugi::node_cdata) {
      const auto begin = static_cast<std::size_t>(std::max<std::ptrdiff_t>(other.offset_debug(), 0));
      text::refuse(name_, line_at(text_.find_first_not_of(" \t\r\n", begin)),
                   "broken XML, text outside of " + quoted_tag(root()) + "; remove it");
    }
    if (other.type() == pugi::node_element && other != root())
      refuse(other, "broken XML, a second root element " + quoted_tag(other) +
                        "; a file holds one: remove it or move it inside " + quoted_tag(root()));
  }
}

/// Converts the file to UTF-8 from whatever encoding it has.  Then names are text, and offsets are those of pugixml.
void xml_file::decode() {
  const auto starts = [this](std::string_view mark) { return std::string_view(text_).substr(0, mark.size()) == mark; };
  // byte-order marks; without one, a < of two bytes begins UTF-16 (XML 1.0, appendix F)
  using namespace std::string_view_literals;
  if (starts("\xff\xfe"sv))
    text_ = utf8_from_utf16(std::string_view(text_).substr(2), false);
  else if (starts("\xfe\xff"sv))
    text_ = utf8_from_utf16(std::string_view(text_).substr(2), true);
  else if (starts("<\0"sv))
    text_ = utf8_from_utf16(text_, false);
  else if (starts("\0<"sv))
    text_ = utf8_from_utf16(text_, true);

  const std::size_t bad = first_not_utf8(text_);
  if (bad == text_.npos)
    return;
  line_starts_ = starts_of_lines(text_);
  guessed_encoding_ =
      "the text is not UTF-8, first in line " + std::to_string(line_at(bad)) + ": read as Latin-1; save it as UTF-8";
  text_ = utf8_from_latin1(text_);
}

int xml_file::line_at(std::size_t offset) const {
  return static_cast<int>(std::upper_bound(line_starts_.begin(), line_starts_.end(), offset) - line_starts_.begin());
}

int xml_file::line_of(pugi::xml_node node) const {
  const std::ptrdiff_t offset = node.offset_debug();
  return offset < 0 ? 0 : line_at(static_cast<std::size_t>(offset));
}

void xml_file::refuse(pugi::xml_node at, const std::string &what) const { text::refuse(name_, line_of(at), what); }

void check_count(const xml_file &file, pugi::xml_node at, std::size_t count, std::size_t most, const char *what) {
  if (count >= most)
    file.refuse(at, "the file has more than " + std::to_string(most) + " " + what + "; split the robot");
}

} // namespace ksl::text
