/* A header that is quiet in its own project, and warns in a user's. */
static inline int rounded(double x) { return x + 0.5; }
