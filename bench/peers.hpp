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

/// All peers of a folder, KSL's first, the others in the order of their names.
inline std::vector<const bench_peer *> load_peers(const std::filesystem::path &folder) {
  std::vector<std::string> paths;
  for (const auto &entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".so")
      paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  std::vector<const bench_peer *> peers;
  for (const std::string &path : paths)
    peers.push_back(symbol<const bench_peer *()>(path, "bench_peer_table")());
  std::stable_sort(peers.begin(), peers.end(), [](const bench_peer *a, const bench_peer *b) {
    const auto rank = [](const bench_peer *p) {
      const std::string name = p->name;
      return name == "KSL, gcc" ? 0 : name == "KSL, clang" ? 1 : 2;
    };
    return rank(a) < rank(b);
  });
  return peers;
}
