// Mutations that keep a text XML: bytes that are changed at random mostly break a tag, which the reader then says, and
// sees no more.
#include <pugixml.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <sstream>
#include <string>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t *bytes, std::size_t size, std::size_t most);

namespace {

using generator = std::minstd_rand;

template <class Items> auto &one_of(Items &items, generator &random) { return items[random() % std::size(items)]; }

/// What a value becomes: numbers at the ends of their ranges, names, nothing.
const char *const values[] = {
    "0",         "-1",      "1e308",         "-1e308",     "1e-400",      "1e400", "5e-324", "0 0 1",
    "1 0 0",     "0 0 0 1", "0 0 1e308",     "1e-300 0 0", "0 0 0 0 0 0", "a",     "b",      "j",
    "world",     "base",    "floating_base", "",           "1.1",         "true",  "inf",    "revolute",
    "universal", "helical", "floating"};

std::vector<pugi::xml_node> elements_of(const pugi::xml_document &document) {
  struct collector : pugi::xml_tree_walker {
    std::vector<pugi::xml_node> all;
    bool for_each(pugi::xml_node &node) override {
      if (node.type() == pugi::node_element)
        all.push_back(node);
      return true;
    }
  } found;
  pugi::xml_document &changeable = const_cast<pugi::xml_document &>(document);
  changeable.traverse(found);
  return found.all;
}

/// Changes an attribute or a text to a value, or to a mutation of what it is.
void change_value(pugi::xml_node node, generator &random) {
  std::vector<pugi::xml_attribute> attributes(node.attributes_begin(), node.attributes_end());
  std::string value = attributes.empty() ? node.child_value() : "";
  pugi::xml_attribute attribute = attributes.empty() ? pugi::xml_attribute() : one_of(attributes, random);
  if (attribute)
    value = attribute.value();
  if (random() % 2) {
    value = one_of(values, random);
  } else {
    const std::size_t size = value.size();
    value.resize(size + 16);
    value.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t *>(value.data()), size, size + 16));
  }
  if (attribute)
    attribute.set_value(value.c_str());
  else
    node.text().set(value.c_str());
}

void change(pugi::xml_document &document, generator &random) {
  std::vector<pugi::xml_node> elements = elements_of(document);
  pugi::xml_node node = one_of(elements, random), other = one_of(elements, random);
  switch (random() % 8) {
  case 0:
    if (node != document.document_element())
      node.parent().remove_child(node);
    break;
  case 1: other.append_copy(node); break;
  case 2: other.prepend_copy(node); break;
  case 3:
    if (other != document.document_element())
      other.parent().insert_copy_after(node, other);
    break;
  case 4: node.set_name(other.name()); break;
  case 5: node.append_attribute(other.first_attribute().name()) = one_of(values, random); break;
  default: change_value(node, random);
  }
}

} // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t *bytes, std::size_t size, std::size_t most, unsigned seed) {
  generator random(seed + 1);
  pugi::xml_document document;
  if (random() % 3 == 0 || !document.load_buffer(bytes, size, pugi::parse_full, pugi::encoding_utf8) ||
      !document.document_element())
    return LLVMFuzzerMutate(bytes, size, most);
  for (std::size_t i = 0, changes = 1 + random() % 3; i < changes; ++i)
    change(document, random);
  std::ostringstream out;
  document.save(out, "", pugi::format_raw | pugi::format_no_declaration, pugi::encoding_utf8);
  const std::string text = out.str();
  if (text.empty() || text.size() > most)
    return LLVMFuzzerMutate(bytes, size, most);
  std::memcpy(bytes, text.data(), text.size());
  return text.size();
}
