/* Inputs of the golden programs, by integer arithmetic alone, and the hash of their results. */
#ifndef GOLDEN_HASH_H
#define GOLDEN_HASH_H

#include <stdint.h>
#include <string.h>

/* Numbers in [-2, 2) with 20 bits: exact in double and in float (splitmix64, Steele, Lea and Flood, OOPSLA 2014). */
static inline double golden_number(uint64_t *state) {
  uint64_t x = *state += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return (double)((int64_t)((x ^ (x >> 31)) >> 44) - (1 << 19)) / (1 << 18);
}

/* FNV-1a over the bits of numbers.  All NaN are one: their signs and payloads are up to the compiler. */
static inline void golden_add_bits(uint64_t *hash, uint64_t bits, int bytes) {
  for (int i = 0; i < bytes; ++i)
    *hash = (*hash ^ ((bits >> (8 * i)) & 255)) * 0x100000001b3u;
}
static inline void golden_add_double(uint64_t *hash, double x) {
  uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  if ((bits & 0x7fffffffffffffffu) > 0x7ff0000000000000u)
    bits = 0x7ff8000000000000u;
  golden_add_bits(hash, bits, 8);
}
static inline void golden_add_float(uint64_t *hash, float x) {
  uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  if ((bits & 0x7fffffffu) > 0x7f800000u)
    bits = 0x7fc00000u;
  golden_add_bits(hash, bits, 4);
}

static const uint64_t golden_start = 0xcbf29ce484222325u;

/* Which functions of the C library were called since golden_libm was zero, a bit for each; and their names, null-terminated. */
#ifdef __cplusplus
extern "C" {
#endif
extern uint64_t golden_libm;
extern const char *const golden_libm_names[];
/* Are others called in their place?  Not while models are built, which need sines and cosines. */
extern int golden_replaces;
#ifdef __cplusplus
}
#endif

#endif
