/* A double that becomes a float, and a float that becomes a double, without a word. */
float half(double x);
float half(double x) { return 0.5 * x; }
