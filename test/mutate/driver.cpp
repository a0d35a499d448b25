// KSL: the main of the C++ tests in a mutated build.  It finds which tests reach which mutants, and then activates one
// mutant after the other, each in a process of its own, and runs the tests that reach it, shortest first, until one
// fails.
//
//   engine_test REACHED                       runs all tests without a mutant; writes which mutants each reaches
//   engine_test REACHED MUTANTS RESULTS JOBS SECONDS   runs the numbers in the file MUTANTS, writes a line for each
//   into RESULTS
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <map>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

constexpr int most_mutants = 20000; // room for more than there are
extern "C" {
int ksl_mutant = 0;
alignas(1 << 16) unsigned char ksl_mutant_reached[1 << 16]; // whole pages, of any size
}
static_assert(sizeof ksl_mutant_reached >= most_mutants + 2);

namespace {

constexpr double long_test = 1.5; // s

using steady = std::chrono::steady_clock;

struct test {
  std::string name;
  double seconds = 0;
  bool failed = false;
  std::vector<unsigned char> reached;
};
std::vector<test> tests; // in doctest's order, so that a test's number is its place

struct recorder : doctest::IReporter {
  std::clock_t start; // of processor time: others may use the machine
  explicit recorder(const doctest::ContextOptions &) {}
  void report_query(const doctest::QueryData &) override {}
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats &) override {}
  void test_case_start(const doctest::TestCaseData &t) override {
    tests.push_back({t.m_name});
    std::memset(ksl_mutant_reached, 0, sizeof ksl_mutant_reached);
    start = std::clock();
  }
  void test_case_reenter(const doctest::TestCaseData &) override {}
  void test_case_end(const doctest::CurrentTestCaseStats &s) override {
    tests.back().seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    tests.back().failed = !s.testCaseSuccess;
    tests.back().reached.assign(ksl_mutant_reached, ksl_mutant_reached + most_mutants + 2);
  }
  void test_case_exception(const doctest::TestCaseException &) override {}
  void subcase_start(const doctest::SubcaseSignature &) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData &) override {}
  void log_message(const doctest::MessageData &) override {}
  void test_case_skipped(const doctest::TestCaseData &) override {}
};

int run_one(int number) {
  doctest::Context context;
  context.setOption("first", number);
  context.setOption("last", number);
  context.setOption("abort-after", 1);
  context.setOption("no-breaks", true);
  return context.run();
}

int record(const char *path) {
  // shared with the copies of this process that tests make: what they reach, the test reaches
  mmap(ksl_mutant_reached, sizeof ksl_mutant_reached, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_FIXED,
       -1, 0);
  int failed;
  {
    doctest::Context context;
    context.setOption("reporters", "recorder");
    failed = context.run();
  }
  FILE *f = std::fopen(path, "w");
  if (!f)
    return 2;
  for (const test &t : tests) {
    std::fprintf(f, "%g\t%d\t%s\t", t.seconds, t.failed, t.name.c_str());
    for (int i = 1; i <= most_mutants; ++i)
      if (t.reached[i])
        std::fprintf(f, "%d ", i);
    std::fputc('\n', f);
  }
  std::fclose(f);
  return failed;
}

std::vector<test> read_recorded(const char *path) {
  std::vector<test> found;
  FILE *f = std::fopen(path, "r");
  char *line = nullptr;
  std::size_t room = 0;
  while (f && getline(&line, &room, f) > 0) {
    test t;
    t.reached.assign(most_mutants + 2, 0);
    char *at = line;
    t.seconds = std::strtod(at, &at);
    at = std::strchr(at + 1, '\t') + 1;
    char *end = std::strchr(at, '\t');
    t.name.assign(at, end);
    for (long i; at = end, i = std::strtol(at, &end, 10), end != at;)
      t.reached[i] = 1;
    found.push_back(t);
  }
  std::free(line);
  return found;
}

// In a child: 0 if every test passes, 1 if one fails, whose number goes into `killer`.
[[noreturn]] void child(int mutant, const std::vector<int> &order, double seconds, int *killer) {
  double all = 0;
  for (const int i : order)
    all += tests[i].seconds;
  const rlimit no_core = {0, 0}, memory = {rlim_t(8) << 30, rlim_t(8) << 30};
  setrlimit(RLIMIT_CORE, &no_core);
  setrlimit(RLIMIT_AS, &memory);
  const rlimit processor = {rlim_t(seconds + 10 * all) + 1, rlim_t(seconds + 10 * all) + 2};
  setrlimit(RLIMIT_CPU, &processor);
  alarm(static_cast<unsigned>(4 * (seconds + 10 * all))); // in case it waits for ever
  const int nothing = open("/dev/null", O_WRONLY);
  dup2(nothing, 1);
  dup2(nothing, 2);
  ksl_mutant = mutant;
  for (const int i : order) {
    *killer = i;
    if (run_one(i + 1))
      _exit(1);
  }
  *killer = -1;
  _exit(0);
}

int kill_all(const char *mutants, const char *results, int jobs, double seconds) {
  std::vector<int> numbers;
  if (FILE *f = std::fopen(mutants, "r"))
    for (int n; std::fscanf(f, "%d", &n) == 1;)
      numbers.push_back(n);
  FILE *out = std::fopen(results, "w");
  if (!out)
    return 2;
  std::vector<int> by_time(tests.size());
  for (std::size_t i = 0; i < by_time.size(); ++i)
    by_time[i] = static_cast<int>(i);
  std::sort(by_time.begin(), by_time.end(), [](int a, int b) { return tests[a].seconds < tests[b].seconds; });
  auto *killers = static_cast<int *>(
      mmap(nullptr, sizeof(int) * (most_mutants + 2), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  struct job {
    int mutant;
    steady::time_point start;
  };
  std::map<pid_t, job> running;
  const auto wait_one = [&] {
    int status;
    const pid_t id = wait(&status);
    const job j = running.at(id);
    running.erase(id);
    const int k = killers[j.mutant];
    const char *how = WIFEXITED(status) && WEXITSTATUS(status) == 0 ? "survived"
                      : WIFEXITED(status)                           ? "failed"
                      : WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM || WTERMSIG(status) == SIGKILL
                          ? "timeout"
                          : "crashed";
    std::fprintf(
        out, "%d\t%s\t%.3f\t%s\n", j.mutant, how, std::chrono::duration<double>(steady::now() - j.start).count(),
        k >= 0 && k < static_cast<int>(tests.size()) ? tests[k].name.c_str() : ""); // a mutant may write anywhere
    std::fflush(out);
  };
  for (const int mutant : numbers) {
    std::vector<int> order;
    for (const int i : by_time)
      if (mutant == 0 || tests[i].reached[mutant])
        order.push_back(i);
    // Long tests are for what short ones don't reach.
    if (std::count_if(order.begin(), order.end(), [](int i) { return tests[i].seconds < long_test; }) >= 3)
      order.erase(std::remove_if(order.begin(), order.end(), [](int i) { return tests[i].seconds >= long_test; }),
                  order.end());
    if (order.empty()) {
      std::fprintf(out, "%d\tunreached\t0\t\n", mutant);
      continue;
    }
    while (static_cast<int>(running.size()) >= jobs)
      wait_one();
    std::fflush(out);
    killers[mutant] = -1;
    const pid_t id = fork();
    if (id == 0)
      child(mutant, order, seconds, &killers[mutant]);
    running[id] = {mutant, steady::now()};
  }
  while (!running.empty())
    wait_one();
  std::fclose(out);
  return 0;
}

} // namespace

DOCTEST_REGISTER_REPORTER("recorder", 0, recorder);

int main(int argc, char **argv) {
  if (argc == 2)
    return record(argv[1]);
  if (argc != 6)
    return 2;
  tests = read_recorded(argv[1]);
  return kill_all(argv[2], argv[3], std::atoi(argv[4]), std::atof(argv[5]));
}
