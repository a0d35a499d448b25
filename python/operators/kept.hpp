// Operators, and kernels of graphics cards, by number.  Programs that JAX has compiled name one by its number, which is random, so that a program
// that was compiled in another process finds none instead of a wrong one.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <random>
#include <unordered_map>

namespace operators {

template <class T> class kept {
public:
  static std::int64_t add(const std::shared_ptr<const T> &of) {
    const std::scoped_lock lock(mutex());
    std::random_device random;
    for (;;) {
      const std::uint64_t bits = (std::uint64_t(random()) << 32 | random()) >> 1;
      if (all().emplace(static_cast<std::int64_t>(bits), of).second)
        return static_cast<std::int64_t>(bits);
    }
  }
  static void remove(std::int64_t number) {
    const std::scoped_lock lock(mutex());
    all().erase(number);
  }
  /// Null if there is none.
  static std::shared_ptr<const T> find(std::int64_t number) {
    const std::scoped_lock lock(mutex());
    const auto found = all().find(number);
    return found == all().end() ? nullptr : found->second;
  }

private:
  static std::mutex &mutex() {
    static std::mutex of_all;
    return of_all;
  }
  static std::unordered_map<std::int64_t, std::shared_ptr<const T>> &all() {
    static auto *const map =
        new std::unordered_map<std::int64_t, std::shared_ptr<const T>>; // threads may still compute at exit
    return *map;
  }
};

} // namespace operators
