// Paths and texts between Python's str and bytes of any encoding.
#pragma once

#include <nanobind/nanobind.h>

#include <string>

namespace paths {

namespace nb = nanobind;

/// As os.fsdecode: bytes that are no text become surrogates.
inline nb::str str_of_path(const std::string &path) {
  return nb::steal<nb::str>(PyUnicode_DecodeFSDefaultAndSize(path.data(), static_cast<Py_ssize_t>(path.size())));
}

/// A text of a description as str and back, whatever its bytes: in UTF-8, others as surrogates.
inline nb::str str_of(const std::string &text) {
  return nb::steal<nb::str>(PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape"));
}
inline std::string bytes_of(nb::handle text) {
  const nb::bytes bytes = nb::steal<nb::bytes>(PyUnicode_AsEncodedString(text.ptr(), "utf-8", "surrogateescape"));
  if (!bytes.is_valid())
    nb::raise_python_error();
  return {bytes.c_str(), bytes.size()};
}

} // namespace paths
