// A name that hides another.
int sum(const int *x, int n);
int sum(const int *x, int n) {
  int total = 0;
  for (int i = 0; i < n; ++i) {
    int total = x[i];
    total += total;
  }
  return total;
}
