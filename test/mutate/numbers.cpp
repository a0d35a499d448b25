// KSL: the number of the active mutant, and those that were reached, for a library that a test program loads.
extern "C" {
__attribute__((visibility("default"))) int ksl_mutant = 0;
__attribute__((visibility("default"))) unsigned char ksl_mutant_reached[20002];
}
