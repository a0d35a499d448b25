// A string that is used after it was moved; a null pointer that is read.
#include <string>
#include <utility>

std::string twice(std::string x);
std::string twice(std::string x) {
  std::string y = std::move(x);
  return y + x;
}

int first(const int *x, bool empty);
int first(const int *x, bool empty) {
  if (empty)
    x = nullptr;
  return x[0];
}
