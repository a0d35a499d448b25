// Runs every operation of every peer between two marks, at which count_instructions.so counts: count PEERS NAME=TABLE[:floating]...
// Prints a line for each count, in the order in which the plug-in writes them.  First all results are compared, as in `compare`.
#include "../measure.hpp"

#include <sys/syscall.h>
#include <unistd.h>

namespace {

constexpr long mark = 0x4b534c;

void count(const char *robot, const entry &e) {
  const bench_operation &o = e.op();
  e.peer->run(e.self, e.operation, nullptr); // memory that the first call takes
  syscall(mark, 1);
  e.peer->run(e.self, e.operation, nullptr);
  syscall(mark, 0);
  std::printf(
      "{\"robot\": \"%s\", \"peer\": \"%s\", \"library\": \"%s\", \"operation\": \"%s\", \"variant\": \"%s\", \"batch\": %d, "
      "\"single\": %d, \"threads\": %d, \"states\": %zu}\n",
      robot, e.peer->name, e.peer->library, o.name, o.variant, o.batch, o.single, o.threads, e.n);
}

/// Those whose kernels arm.mk compiles.
constexpr const char *operations[] = {"rnea", "aba", "crba", "crba_upper", "inverse_dynamics_derivatives"};

bool counted(const bench_peer &, const bench_operation &o) {
  const auto is_named = [&](const char *name) { return !std::strcmp(name, o.name); };
  return o.threads == 1 && std::any_of(std::begin(operations), std::end(operations), is_named);
}

} // namespace

int main(int argc, char **argv) {
  const std::string folder = argc > 1 ? argv[1] : ".", suffix = ":floating";
  const std::vector<const bench_peer *> peers = load_peers(folder, {});
  auto *const describe = symbol<bool(const char *, int, bench_model *)>(folder + "/" + argv[2], "bench_describe");
  for (int i = 3; i < argc; ++i) {
    const std::string word = argv[i];
    const bool floating = word.ends_with(suffix);
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals),
                      path = word.substr(equals + 1, word.size() - equals - 1 - (floating ? suffix.size() : 0));
    bench_model model;
    if (!describe(path.c_str(), floating, &model))
      return 1;
    contest c(model, peers, 32, 1024, counted);
    if (!c.agree())
      return 1;
    for (const entry &e : c.entries)
      count(name.c_str(), e);
  }
}
