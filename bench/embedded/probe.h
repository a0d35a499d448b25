/* What is looked at around a call on an emulated microcontroller: marks, between which instructions are counted, the depth of the stack, and the bytes
   of the results. */
#include <stddef.h>
#include <stdio.h>

enum { ROOM = 8192, PAINT = 0xa5 };

__attribute__((noinline)) void mark(void) { __asm volatile("" ::: "memory"); }

/* Fills the stack below the caller. */
__attribute__((noinline)) static void paint(void) {
  volatile unsigned char room[ROOM];
  size_t i;
  for (i = 0; i < ROOM; ++i)
    room[i] = PAINT;
}

/* Bytes of the stack below the caller that have been written since. */
__attribute__((noinline)) static unsigned touched(void) {
  volatile unsigned char room[ROOM];
  size_t i = 0;
  while (i < ROOM && room[i] == PAINT)
    ++i;
  return (unsigned)(ROOM - i);
}

/* The bytes as they lie in memory, in hexadecimal digits. */
static void print_bytes(const char *what, int state, const void *result, size_t size) {
  const unsigned char *const bytes = (const unsigned char *)result;
  size_t i;
  printf("bytes %s %d ", what, state);
  for (i = 0; i < size; ++i)
    printf("%02x", (unsigned)bytes[i]);
  printf("\n");
}
