#include "text/markup.hpp"

#include "text/limits.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <vector>

namespace ksl::text {

namespace {

/// Reads a text from left to right, and notes what it finds.
///
///     text      = { markup | reference | character }
///     markup    = "<!--" … "-->"  |  "<![CDATA[" … "]]>"  |  "<?" … "?>"  |  "<!DOCTYPE", where reading ends  |  tag
///     tag       = "<" { reference | character | quoted value } ">"
///     reference = "&" ("lt" | "gt" | "amp" | "quot" | "apos" | "#" digits | "#x" hexadecimal digits) ";"
///
/// XML 1.0, productions 15, 16, 18, 28, 40, 66 and 68, as far as they tell where an & is markup; the rest is pugixml's.
class reader_of_markup {
public:
  explicit reader_of_markup(std::string_view text) : text_(text) {}

  markup read() {
    while (at_ < text_.size() && !found_.doctype && found_.elements <= limits::elements) {
      if (text_[at_] == '<')
        read_markup();
      else
        read_character();
    }
    return std::move(found_);
  }

private:
  bool starts(std::string_view words) const { return text_.substr(at_, words.size()) == words; }

  void read_markup() {
    if (starts("<!--"))
      skip("<!--", "-->");
    else if (starts("<![CDATA["))
      skip("<![CDATA[", "]]>");
    else if (starts("<!DOCTYPE"))
      found_.doctype = {at_, "a DOCTYPE, whose entities could stand for anything; remove it, robot files need none"};
    else if (starts("<?"))
      skip("<?", "?>");
    else
      read_tag();
  }

  /// Comments and the like, in which & stands for itself.
  void skip(std::string_view begin, std::string_view end) {
    const std::size_t last = text_.find(end, at_ + begin.size());
    const std::size_t after = last == text_.npos ? text_.size() : last + end.size();
    while (at_ < after)
      read_plain_character();
  }

  /// A tag to its >.  In quotes, a > is part of a value.
  void read_tag() {
    const char next = at_ + 1 < text_.size() ? text_[at_ + 1] : '/';
    found_.elements += next != '/' && next != '!';
    char quote = 0;
    for (++at_; at_ < text_.size();) {
      const char c = text_[at_];
      if (quote == 0 && c == '>')
        break;
      if (quote == 0 && (c == '"' || c == '\''))
        quote = c;
      else if (c == quote)
        quote = 0;
      read_character();
    }
    at_ += at_ < text_.size();
  }

  void read_character() {
    if (text_[at_] == '&' && !found_.fault)
      read_reference();
    else
      read_plain_character();
  }

  void read_plain_character() {
    const auto byte = static_cast<unsigned char>(text_[at_]);
    // U+FFFE and U+FFFF are ef bf be and ef bf bf; control characters are below 0x20
    if (byte >= 0x20 && byte < 0xef) { // what is forbidden begins with other bytes
      ++at_;
      return;
    }
    const auto [code, bytes] = first_character(text_.substr(at_));
    if (bytes > 0 && !is_allowed_in_xml(code) && !found_.fault) {
      const std::string what = code < 0x20 ? "a control character, " + printable(text_.substr(at_, bytes))
                                           : "the character U+" + std::string(code == 0xffff ? "FFFF" : "FFFE");
      found_.fault = {at_, what + ", which XML forbids; remove it"};
    }
    at_ += std::max<std::size_t>(bytes, 1);
  }

  /// From & to the semicolon.
  void read_reference() {
    constexpr std::size_t longest = 64;
    const std::string_view rest = text_.substr(at_ + 1, longest);
    const auto is_of_name = [](char c) {
      return c == '#' || c == '.' || c == '-' || c == '_' || c == ':' || (c >= '0' && c <= '9') ||
             (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || static_cast<unsigned char>(c) >= 0x80;
    };
    const auto end = static_cast<std::size_t>(std::find_if_not(rest.begin(), rest.end(), is_of_name) - rest.begin());
    const std::string_view name = rest.substr(0, end);
    if (end == rest.size() || rest[end] != ';')
      found_.fault = {at_, "an & that begins no reference; write &amp; for the character &"};
    else if (name.substr(0, 1) == "#")
      read_number(name);
    else if (name != "lt" && name != "gt" && name != "amp" && name != "quot" && name != "apos")
      found_.fault = {at_, "the reference " + quoted('&' + std::string(name) + ';') +
                               " is unknown; write the character itself, and &amp; for the character &"};
    ++at_;
  }

  /// "#65", "#x41".
  void read_number(std::string_view name) {
    const bool hexadecimal = name.substr(0, 2) == "#x";
    char32_t code = 0;
    bool is_number = name.size() > (hexadecimal ? 2u : 1u);
    for (const char c : name.substr(hexadecimal ? 2 : 1)) {
      const std::size_t digit =
          std::string_view("0123456789abcdef").find(c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c);
      is_number = is_number && digit < (hexadecimal ? 16 : 10);
      code = std::min<char32_t>(0x110000, code * (hexadecimal ? 16 : 10) + static_cast<char32_t>(digit & 0xf));
    }
    if (!is_number || !is_allowed_in_xml(code))
      found_.fault = {at_, "the reference " + quoted('&' + std::string(name) + ';') +
                               " stands for no character that XML allows; remove it"};
  }

  std::string_view text_;
  std::size_t at_ = 0;
  markup found_;
};

std::string more_than(std::size_t count, const char *what, std::size_t most) {
  return " has " + std::to_string(count) + " " + what + ", more than " + std::to_string(most);
}
std::string too_long(std::size_t size) {
  return " has " + std::to_string(size) + " bytes, more than 1 MiB; remove it, or put it into another file";
}
static_assert(limits::value_bytes == std::size_t{1} << 20);

/// The name of something, if it is too long.
std::string name_fault(const std::string &what, std::string_view name) {
  if (name.size() <= limits::name_bytes)
    return {};
  return what + more_than(name.size(), "bytes", limits::name_bytes) + ", " + quoted(name) + "; shorten it";
}

/// What is wrong if an element gives an attribute twice.  Sorts the names of its attributes.
std::string twice(const std::string &tag, std::vector<std::string_view> &names) {
  std::sort(names.begin(), names.end());
  const auto same = std::adjacent_find(names.begin(), names.end());
  return same == names.end() ? ""
                             : "broken XML, " + tag + " gives " + shortened(*same, 100) + " twice; keep one of them";
}

/// What is wrong with the attributes of one element, which messages call `tag`; empty: nothing.
std::string fault_of_attributes(pugi::xml_node node, const std::string &tag) {
  std::vector<std::string_view> names;
  for (const pugi::xml_attribute attribute : node.attributes()) {
    const std::string_view name = attribute.name(), value = attribute.value();
    names.push_back(name);
    if (std::string fault = name_fault("the name of an attribute of " + tag, name); !fault.empty())
      return fault;
    if (value.size() > limits::value_bytes)
      return std::string(name) + " of " + tag + too_long(value.size());
    if (name == "name")
      if (std::string fault = name_fault("the name of " + tag, value); !fault.empty())
        return fault;
  }
  if (names.size() > limits::attributes)
    return tag + more_than(names.size(), "attributes", limits::attributes) + "; remove some";
  return twice(tag, names);
}

/// What is wrong with one element, whatever is around it; empty: nothing.
std::string fault_of(pugi::xml_node node) {
  if (std::string fault = name_fault("the name of an element", node.name()); !fault.empty())
    return fault;
  const std::string tag = "<" + std::string(node.name()) + ">";
  if (std::string fault = fault_of_attributes(node, tag); !fault.empty())
    return fault;
  for (const pugi::xml_node child : node.children())
    if (const std::string_view text = child.value(); text.size() > limits::value_bytes)
      return "the text in " + tag + too_long(text.size());
  return {};
}

/// "link base: " for what is in that link; empty for what is in no link, joint or model.
std::string owner_of(pugi::xml_node node) {
  for (; node; node = node.parent())
    for (const std::string_view kind : {"link", "joint", "drake:joint", "model"})
      if (node.name() == kind)
        return std::string(kind == "drake:joint" ? "joint" : kind) + " " +
               shortened(node.attribute("name").value(), 100) + ": ";
  return {};
}

} // namespace

markup look_at(std::string_view text) { return reader_of_markup(text).read(); }

/// Depth first, without recursion: until here nothing has limited how deep elements are in each other.
std::optional<element_fault> fault_in_elements(const pugi::xml_document &document) {
  std::size_t depth = 1;
  for (pugi::xml_node node = document.document_element(); node;) {
    if (node.type() == pugi::node_element) {
      if (depth > limits::depth)
        return element_fault{node, "<" + shortened(node.name(), 100) + "> is in " + std::to_string(limits::depth) +
                                       " other elements; at most " + std::to_string(limits::depth) +
                                       " may be in each other"};
      if (std::string fault = fault_of(node); !fault.empty())
        return element_fault{node, owner_of(node) + fault};
    }
    if (node.first_child()) {
      node = node.first_child();
      ++depth;
      continue;
    }
    while (node.parent() && !node.next_sibling()) {
      node = node.parent();
      --depth;
    }
    node = node.next_sibling(); // also of the root: a comment, or a second root
  }
  return std::nullopt;
}

} // namespace ksl::text
