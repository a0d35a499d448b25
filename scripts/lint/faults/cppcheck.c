/* An element behind the end of an array. */
int last(void);
int last(void) {
  int x[4] = {1, 2, 3, 4};
  return x[4];
}
