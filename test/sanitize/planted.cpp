// Faults that a sanitizer must report: planted FAULT.  "none" has none.  volatile: nothing is known when this is compiled.
#include <cstdlib>
#include <cstring>
#include <thread>

static volatile int one = 1, large = 40;
static volatile double huge = 1e300;
static int shared;

static void add() {
  for (int i = 0; i < 1000; ++i)
    shared = shared + 1;
}

int main(int, char **argv) {
  const char *fault = argv[1];
  const auto is = [&](const char *name) { return std::strcmp(fault, name) == 0; };
  if (is("heap")) {
    volatile char *const bytes = static_cast<char *>(std::malloc(8));
    bytes[8 * one] = 1;
    std::free(const_cast<char *>(bytes));
  } else if (is("leak")) {
    void *volatile lost = std::malloc(64);
    lost = nullptr;
  } else if (is("uninitialised")) {
    volatile int *const number = static_cast<int *>(std::malloc(sizeof(int)));
    if (*number == 17)
      one = 2;
    std::free(const_cast<int *>(number));
  } else if (is("shift")) {
    one = one << large;
  } else if (is("truncation")) {
    const volatile int wide = 100000;
    volatile short narrow = wide;
    one = narrow;
  } else if (is("float-cast")) {
    one = static_cast<int>(huge);
  } else if (is("race")) {
    std::thread other(add);
    add();
    other.join();
  }
  return 0;
}
