#include "robot_text.hpp"

#include "ksl/dynamics.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <set>

/// Most of the time of a small text is the sanitizer's own: less of what only reports of leaks need.
extern "C" const char *__asan_default_options() {
  return "malloc_context_size=4:quarantine_size_mb=16:max_malloc_fill_size=64";
}

namespace ksl::fuzz {

namespace {

const std::string file = "fuzzed.xml";

/// Seconds of processor time of this thread.  Other processes must not make a text look slow.
double seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Fowler, Noll and Vo's hash, 32 bits.
std::uint32_t hash(const std::string &text) {
  std::uint32_t h = 2166136261;
  for (const char c : text)
    h = (h ^ static_cast<unsigned char>(c)) * 16777619u;
  return h;
}

/// Is the text one line that a terminal shows as it is: without control characters and without marks that turn the
/// order of letters?
bool is_plain(const std::string &text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = [&](std::size_t k) { return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u; };
    if (byte(0) < 0x20 || byte(0) == 0x7f || (byte(0) == 0xc2 && byte(1) < 0xa0))
      return false;
    if (byte(0) == 0xe2 && ((byte(1) == 0x80 && byte(2) >= 0xa8 && byte(2) <= 0xae) ||
                            (byte(1) == 0x81 && byte(2) >= 0xa6 && byte(2) <= 0xa9)))
      return false;
  }
  return true;
}

void check_sentence(const std::string &message, const std::string &what) {
  if (message.empty())
    broken(what + " says something", "");
  if (message.size() > 5000)
    broken(what + " is short", std::to_string(message.size()) + " bytes");
  if (!is_plain(message))
    broken(what + " has no control characters", message);
}

template <class Items> void check_unique(const Items &items, const std::string &kind) {
  std::set<std::string> names;
  for (const auto &item : items)
    if (item.name.empty() || !names.insert(item.name).second)
      broken("names are unique", kind + " " + item.name);
}

void check_finite(const double *numbers, std::size_t n, const std::string &what) {
  for (std::size_t i = 0; i < n; ++i)
    if (!std::isfinite(numbers[i]))
      broken("a model that is loaded is finite", what);
}
template <class Value> void check_finite(const Value &value, const std::string &what) {
  static_assert(sizeof value % sizeof(double) == 0);
  check_finite(reinterpret_cast<const double *>(&value), sizeof value / sizeof(double), what);
}

void check_model(const model &m) {
  check_unique(m.links(), "link");
  check_unique(m.joints(), "joint");
  const model_view<double> v = m.view();
  check_finite(v.gravity, "gravity");
  for (int i = 0; i < v.bodies; ++i) {
    const std::string which = "body " + std::to_string(i);
    check_finite(v.body[i].placement, which + ", placement");
    check_finite(v.body[i].theta0, which + ", theta0");
    check_finite(v.body[i].alpha, which + ", alpha");
    check_finite(v.body[i].pitch, which + ", pitch");
    check_finite(v.augmented[i], which + ", augmented inertia");
    check_finite(bodies_at<double, double>{i}.get<spatial_inertia>(v.inertia), which + ", inertia");
  }
  for (const std::string &line : m.description().warnings)
    if (!is_plain(line))
      broken("a warning has no control characters", line);
  for (const std::string &line : m.description().unused)
    if (!is_plain(line))
      broken("a line about unused content has no control characters", line);
}

std::optional<model> load_or_refuse(const std::string &text) {
  const std::uint32_t h = hash(text);
  model_options options;
  options.floating_base = h % 4 == 0;
  const load_options how = {
      .mimic_independent = h / 4 % 4 == 0, .strict = h / 16 % 8 == 0, .masses_optional = h / 128 % 4 != 0};
  if (h / 512 % 4 == 0) {
    options.physics.emplace();
    options.physics->damping = options.physics->friction = options.physics->armature = options.physics->spring = true;
    options.physics->rotor = true, options.physics->rotor_bodies = h / 2048 % 2 == 0;
  }
  try {
    return load_text(text, options, how, file);
  } catch (const description_error &error) {
    check_sentence(error.what(), "a refusal");
    if (std::string(error.what()).substr(0, file.size()) != file)
      broken("a refusal names the file", error.what());
    return std::nullopt;
  } // any other exception ends the process, which libFuzzer reports
}

} // namespace

void broken(const std::string &promise, const std::string &detail) {
  std::fprintf(stderr, "broken promise: %s\n%s\n", promise.c_str(), detail.c_str());
  std::abort();
}

std::optional<model> loaded(const std::uint8_t *bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char *>(bytes), size);
  const double start = seconds();
  std::optional<model> m = load_or_refuse(text);
  // sanitizers take ten times as long as the promised second for each megabyte; less than this can't be told from the
  // system's own
  const double took = seconds() - start, most = 0.25 + 10e-6 * static_cast<double>(size);
  if (took > most)
    broken("time is linear", std::to_string(took) + " s for " + std::to_string(size) + " bytes");
  if (m)
    check_model(*m);
  return m;
}

} // namespace ksl::fuzz
