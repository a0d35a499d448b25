#include "load/xml.hpp"

#include "load/words.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <string_view>
#include <system_error>

namespace ksl::load {

namespace {

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

/// Converts UTF-16 to UTF-8; invalid code units become U+FFFD.
std::string utf8_from_utf16(std::string_view bytes, bool big_endian) {
  const auto unit = [&](std::size_t i) -> char32_t {
    const auto first = static_cast<unsigned char>(bytes[i]), second = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<char32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
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

/// Length in bytes of the first UTF-8 character; 0 if it is invalid (truncated, overlong, a surrogate).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80)
    return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0   ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (length == 0 || text.size() < length)
    return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80)
      return 0;
  const unsigned second = byte(1);
  const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool beyond = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
  return overlong || beyond ? 0 : length;
}

std::size_t first_not_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0)
      return i;
    i += length;
  }
  return text.npos;
}

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

} // namespace

std::string bytes_of_file(const std::string &path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (path.empty())
    refuse("", 0, "the path of the file is empty; give the path of a URDF file");
  if (status.type() == fs::file_type::not_found)
    refuse(path, 0,
           "there is no such file; check the path, which starts at the current folder unless it begins with /");
  if (fs::is_directory(status))
    refuse(path, 0, "this is a folder, not a file; give the path of a URDF file in it");

  const auto close = [](std::FILE *file) { std::fclose(file); };
  const std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "rb"), close);
  const auto cannot_read = [&path] {
    if (errno == ENOMEM) // of the stream
      throw std::bad_alloc();
    const std::string why = std::error_code(errno, std::generic_category()).message();
    refuse(path, 0, "the file can't be read (" + why + "); check its permissions");
  };
  if (!file)
    cannot_read();
  std::string bytes;
  char block[1 << 16];
  for (std::size_t n; (n = std::fread(block, 1, sizeof block, file.get())) > 0;)
    bytes.append(block, n);
  if (std::ferror(file.get()))
    cannot_read();
  return bytes;
}

xml_file::xml_file(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) {
  if (text_.empty())
    load::refuse(name_, 0, "the file is empty, expected a <robot> element; give a URDF file");
  decode();
  line_starts_ = starts_of_lines(text_);
  // a zero byte would end the text without an error
  if (const auto zero = text_.find('\0'); zero != text_.npos)
    load::refuse(name_, line_at(zero), "a zero byte, so this is no text file; save it as UTF-8 text");

  const auto result = document_.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (result.status == pugi::status_out_of_memory)
    throw std::bad_alloc();
  if (result.status == pugi::status_no_document_element)
    load::refuse(name_, 0, "the file holds no XML element, expected <robot>; give a URDF file");
  if (!result)
    load::refuse(name_, line_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))),
                 "broken XML, " + reason(result) + "; correct it here, or close the tag that was opened above");
  // pugixml accepts several root elements
  for (pugi::xml_node other = root().next_sibling(); other; other = other.next_sibling())
    if (other.type() == pugi::node_element)
      refuse(other, "broken XML, a second root element <" + std::string(other.name()) +
                        ">; a file holds one: remove it or move it inside <" + root().name() + ">");
}

/// Converts the file to UTF-8 from whatever encoding it has.  Then names are text, and offsets are those of pugixml.
void xml_file::decode() {
  const auto starts = [this](std::string_view mark) { return std::string_view(text_).substr(0, mark.size()) == mark; };
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

void xml_file::refuse(pugi::xml_node at, const std::string &what) const { load::refuse(name_, line_of(at), what); }

} // namespace ksl::load
