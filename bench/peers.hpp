// Loads peers, the shared objects in a folder, so that none sees another's symbols.
#pragma once

#include "peer.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <string>
#include <vector>

/// A symbol of a shared object; ends the program if it is missing.
template <class Function> Function *symbol(const std::string &path, const char *name) {
  void *library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void *found = library ? dlsym(library, name) : nullptr;
  if (!found) {
    std::fprintf(stderr, "%s\n", dlerror());
    std::exit(1);
  }
  return reinterpret_cast<Function *>(found);
}

/// A KSL build, or all of them that lie in a folder, then the other peers of the folder, in the order of their names.
inline std::vector<const bench_peer *> load_peers(const std::filesystem::path &folder, std::vector<std::string> ksl) {
  std::vector<std::string> others;
  const bool given = !ksl.empty();
  for (const auto &entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".so") {
      const bool is_ksl = entry.path().filename().string().starts_with("ksl_");
      if (!is_ksl || !given)
        (is_ksl ? ksl : others).push_back(entry.path().string());
    }
  std::sort(others.begin(), others.end());
  if (!given)
    std::sort(ksl.begin(), ksl.end()); // clang first: what users build where it is there
  ksl.insert(ksl.end(), others.begin(), others.end());
  std::vector<const bench_peer *> peers;
  for (const std::string &path : ksl)
    peers.push_back(symbol<const bench_peer *()>(path, "bench_peer_table")());
  return peers;
}
