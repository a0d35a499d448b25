// Times of all libraries side by side, in one process and in turns: `compare ROBOT... [options]`, see usage().
#include "measure.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

namespace {

struct settings {
  std::vector<std::string> robots, operations, libraries, ksl;
  size_t few = 128, many = 1024;
  int repetitions = 31;
  double least_seconds = 1.5;
  bool batch = true, only_isa = false;
  std::string json;
  std::filesystem::path home; ///< folder of this program, which contains peers/ and robots.txt
};

[[noreturn]] void usage() {
  std::puts(
      "usage: compare ROBOT... [--ops rnea,derivatives,...] [--reps 31] [--seconds 1.5] [--few 128] [--many 1024]\n"
      "               [--libraries KSL,Pinocchio,...] [--ksl FILE] [--isa SET] [--one-state] [--json FILE]\n"
      "       compare [--isa SET] --show-isa\n"
      "ROBOT: a name in robots.txt beside this program, or a URDF file; FILE:floating for a floating base.\n"
      "ops: names of operations, or parts of names; all by default.\n"
      "reps, seconds: at least so many turns, and so long, for each robot.\n"
      "few: different states that single calls run over; many: states in a batch.\n"
      "libraries: KSL, Pinocchio, Pinocchio wheel, MuJoCo, KDL; all by default.\n"
      "ksl: a ksl_peer (ksl_gcc.so) of another build; twice to compare two builds.  By default those beside this "
      "program.\n"
      "isa: the instruction set of KSL's kernels, x86-64-v3 say; the best that is built and runs here by default.  "
      "--show-isa prints its name.\n"
      "\nOperations:");
  for (const quantity &x : quantities)
    std::printf("  %s\n", x.name);
  std::exit(2);
}

std::vector<std::string> split(const std::string &text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');)
    parts.push_back(part);
  return parts;
}

/// The operations with these names, in the order of the list.  A word that is no name stands for all that contain it.
std::vector<std::string> find_operations(const std::vector<std::string> &words) {
  std::vector<std::string> found;
  for (const quantity &x : quantities) {
    const std::string name = x.name;
    const auto meant = [&](const std::string &word) {
      const bool is_name =
          std::any_of(std::begin(quantities), std::end(quantities), [&](const quantity &y) { return y.name == word; });
      return is_name ? name == word : name.find(word) != name.npos;
    };
    if (words.empty() || std::any_of(words.begin(), words.end(), meant))
      found.push_back(name);
  }
  return found;
}

settings parse(int argc, char **argv) {
  settings s;
  std::vector<std::string> words;
  s.home = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] {
      if (++i >= argc)
        usage();
      return argv[i];
    };
    if (word == "--ops")
      words = split(value());
    else if (word == "--libraries")
      s.libraries = split(value());
    else if (word == "--ksl")
      s.ksl.push_back(std::filesystem::absolute(value()).string());
    else if (word == "--reps")
      s.repetitions = std::atoi(value());
    else if (word == "--seconds")
      s.least_seconds = std::atof(value());
    else if (word == "--few")
      s.few = std::strtoull(value(), nullptr, 10);
    else if (word == "--many")
      s.many = std::strtoull(value(), nullptr, 10);
    else if (word == "--isa")
      setenv("KSL_ISA", value(), 1); // KSL builds read it at their first call
    else if (word == "--show-isa")
      s.only_isa = true;
    else if (word == "--one-state")
      s.batch = false;
    else if (word == "--json")
      s.json = value();
    else if (word[0] == '-')
      usage();
    else
      s.robots.push_back(word);
  }
  s.operations = find_operations(words);
  if (s.operations.empty() || s.robots.empty() != s.only_isa || s.repetitions < 1 || s.few < 1 || s.many < 1)
    usage();
  return s;
}

bool contains(const std::vector<std::string> &list, const std::string &item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

/// Path and base of a robot given by name or file.
std::pair<std::string, bool> find_robot(const settings &s, const std::string &robot) {
  std::ifstream in(s.home / "robots.txt");
  std::string name, base, path;
  while (in >> name >> base && std::getline(in >> std::ws, path))
    if (name == robot)
      return {path, base == "floating"};
  const std::string suffix = ":floating";
  const bool floating = robot.size() > suffix.size() && robot.ends_with(suffix);
  return {floating ? robot.substr(0, robot.size() - suffix.size()) : robot, floating};
}

bool is_ksl(const bench_peer &p) { return p.library == std::string("KSL"); }

double ns(const entry *e) { return e ? median(e->times) : std::numeric_limits<double>::quiet_NaN(); }

/// A number, or a dash if there is none.
std::string cell(double x, const char *format = "%.2f") {
  char text[32] = "-";
  if (!std::isnan(x))
    std::snprintf(text, sizeof text, format, x);
  return text;
}

/// Ratios are those of the first KSL build.
void print_row(const contest &c, const std::vector<const bench_peer *> &peers, const std::string &robot,
               const std::string &operation) {
  const std::string theirs = quantity_of(operation.c_str()).of_others();
  const auto of = [&](const char *library) {
    return ns(c.best([&](const bench_peer &p) { return p.library == std::string(library); }, theirs));
  };
  const auto ksl = [&](size_t i, auto... how) {
    return i < peers.size() ? ns(c.best([&](const bench_peer &p) { return &p == peers[i]; }, operation, how...))
                            : std::numeric_limits<double>::quiet_NaN();
  };
  const entry *rival = c.best([](const bench_peer &p) { return p.library == std::string("Pinocchio"); }, theirs);
  const double first = ksl(0), best = ns(rival), batch = ksl(0, 1), single = ksl(0, 1, 1), two = ksl(0, 1, 0, 2);
  const double second = peers.size() > 1 && is_ksl(*peers[1]) ? ksl(1) : std::numeric_limits<double>::quiet_NaN();
  std::printf("%-10s %-28s %8s %8s %8s | %6s %6s %6s %6s | %8s %6s %8s %6s %6s | %s %s\n", robot.c_str(),
              operation.c_str(), cell(first, "%.1f").c_str(), cell(second, "%.1f").c_str(), cell(best, "%.1f").c_str(),
              cell(best / first).c_str(), cell(of("Pinocchio wheel") / first).c_str(),
              cell(of("MuJoCo") / first).c_str(), cell(of("KDL") / first).c_str(), cell(batch, "%.1f").c_str(),
              cell(best / batch).c_str(), cell(single, "%.1f").c_str(), cell(batch / single).c_str(),
              cell(batch / two).c_str(), rival ? rival->peer->name : "", rival ? rival->op().variant : "");
}

void print_head(const settings &s, const std::vector<const bench_peer *> &peers) {
  std::printf("ns a state, medians of %d turns or more; batches of %zu states; x: times faster than that library\n",
              s.repetitions, s.many);
  std::string missing;
  for (const std::string &operation : s.operations)
    if (std::none_of(peers[0]->operation, peers[0]->operation + peers[0]->operations,
                     [&](const bench_operation &o) { return o.name == operation; }))
      missing += (missing.empty() ? "" : ", ") + operation;
  if (!missing.empty())
    std::printf("not in this build of KSL: %s\n", missing.c_str());
  const auto name = [&](size_t i) { // without the name of the library
    return i < peers.size() && is_ksl(*peers[i]) ? "KSL " + std::string(peers[i]->name).substr(5) : "";
  };
  std::printf("%-39s %8s %8s %8s | %6s %6s %6s %6s | %8s %6s %8s %6s %6s | %s\n", "", name(0).c_str(), name(1).c_str(),
              "best Pin", "x Pin", "x whl", "x MuJ", "x KDL", "batch", "x Pin", "float", "x dbl", "2 thr",
              "best Pinocchio is");
}

/// Peak rates and the speed of memcpy, measured once in each turn, so that they see the same state of the machine.
struct peaks {
  std::map<std::string, std::vector<double>> rates;

  void in_turn() {
    rates["fused_double"].push_back(fused_rate<double_vector>());
    rates["fused_float"].push_back(fused_rate<float_vector>());
    rates["unfused_double"].push_back(unfused_rate<double_vector>());
    rates["unfused_float"].push_back(unfused_rate<float_vector>());
  }
  void copying() {
    for (int i = 0; i < 3; ++i)
      rates["copy"].push_back(copy_rate());
  }
  void add(const peaks &other) {
    for (const auto &[name, x] : other.rates)
      rates[name].insert(rates[name].end(), x.begin(), x.end());
  }
  std::string json() const {
    std::ostringstream out;
    for (const auto &[name, x] : rates)
      out << (out.tellp() ? ", \"" : "{\"") << name << "\": " << median(x);
    return out.str() + "}";
  }
};

std::string json_of(const contest &c, const bench_model &m, const peaks &p) {
  std::ostringstream out;
  out << "{\"joints\": " << m.joints << ", \"nq\": " << m.nq << ", \"nv\": " << m.nv << ", \"urdf\": \"" << m.urdf
      << "\",\n  \"limits\": " << p.json() << ",\n  \"times\": [";
  const char *comma = "\n";
  for (const entry &e : c.entries) {
    out << comma << "    {\"peer\": \"" << e.peer->name << "\", \"library\": \"" << e.peer->library
        << "\", \"operation\": \"" << e.op().name << "\", \"variant\": \"" << e.op().variant
        << "\", \"batch\": " << e.op().batch << ", \"single\": " << e.op().single << ", \"threads\": " << e.op().threads
        << ", \"states\": " << e.n << ", \"error\": " << e.error << ", \"median_ns\": " << median(e.times)
        << ", \"minimum_ns\": " << *std::min_element(e.times.begin(), e.times.end()) << "}";
    comma = ",\n";
  }
  out << "],\n  \"state_bytes\": " << (c.entries.empty() ? 0 : c.entries[0].peer->state_bytes(c.entries[0].self))
      << "}";
  return out.str();
}

void write_json(const settings &s, const peaks &p, const std::vector<std::string> &robots,
                const std::vector<const bench_peer *> &peers, const char *instruction_set) {
  std::ofstream out(s.json);
  out << "{\"repetitions\": " << s.repetitions << ", \"few\": " << s.few << ", \"many\": " << s.many
      << ", \"instruction_set\": \"" << instruction_set << "\",\n\"peers\": {";
  const char *comma = "";
  for (const bench_peer *peer : peers)
    out << comma << "\"" << peer->name << "\": \"" << peer->version << "\"", comma = ", ";
  out << "},\n\"limits\": " << p.json() << ",\n\"robots\": {";
  comma = "\n";
  for (size_t i = 0; i < robots.size(); ++i)
    out << comma << "\"" << s.robots[i] << "\": " << robots[i], comma = ",\n";
  out << "}}\n";
}

} // namespace

int main(int argc, char **argv) {
  const settings s = parse(argc, argv);
  const std::filesystem::path ours = s.home / "peers/ksl_clang.so";
  const std::string ksl = !s.ksl.empty()                  ? s.ksl[0]
                          : std::filesystem::exists(ours) ? ours.string()
                                                          : (s.home / "peers/ksl_gcc.so").string();
  auto *const describe = symbol<bool(const char *, int, bench_model *)>(ksl, "bench_describe");
  const char *instruction_set = symbol<const char *()>(ksl, "bench_instruction_set")();
  if (!instruction_set)
    return 1;
  if (s.only_isa) {
    std::puts(instruction_set);
    return 0;
  }
  const std::vector<const bench_peer *> peers = load_peers(s.home / "peers", s.ksl);
  const auto wanted = [&](const bench_peer &p, const bench_operation &o) {
    const auto meant = [&](const std::string &operation) {
      return o.name == (is_ksl(p) ? operation : quantity_of(operation.c_str()).of_others());
    };
    return std::any_of(s.operations.begin(), s.operations.end(), meant) && (s.batch || !o.batch) &&
           (o.threads == 1 || s.many >= 4096) && (s.libraries.empty() || contains(s.libraries, p.library));
  };
  peaks machine;
  std::vector<std::string> robots;
  print_head(s, peers);
  for (const std::string &robot : s.robots) {
    const auto [path, floating] = find_robot(s, robot);
    bench_model model;
    if (!describe(path.c_str(), floating, &model))
      return 1;
    contest c(model, peers, s.few, s.many, wanted);
    if (!c.agree())
      return 1;
    peaks here;
    here.copying();
    c.measure(s.repetitions, s.least_seconds, [&] { here.in_turn(); });
    machine.add(here);
    for (const std::string &operation : s.operations)
      print_row(c, peers, robot, operation);
    std::fflush(stdout);
    robots.push_back(json_of(c, model, here));
  }
  const auto rate = [&](const char *name) { return median(machine.rates[name]) * 1e-9; };
  std::printf(
      "peak, GFLOP/s: %.1f double, %.1f float fused; %.1f double, %.1f float not fused; copy %.1f GB/s; kernels %s\n",
      rate("fused_double"), rate("fused_float"), rate("unfused_double"), rate("unfused_float"), rate("copy"),
      instruction_set);
  if (!s.json.empty())
    write_json(s, machine, robots, peers, instruction_set);
}
