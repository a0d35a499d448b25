/* How a Cortex-M begins: the table of vectors, and the floating-point unit switched on.  Then newlib's own start for semihosting. */
#include <stdint.h>

extern uint32_t stack_top[];
extern void _start(void);
void reset(void);
void fault(void);

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};

void reset(void) {
  *(volatile uint32_t *)0xe000ed88u |= 0xfu << 20; /* CPACR: coprocessors 10 and 11 */
  __asm volatile("dsb\n isb" ::: "memory");
  _start();
}

/* A breakpoint that semihosting doesn't know ends qemu with an error. */
void fault(void) {
  __asm volatile("movs r0, #0x18\n ldr r1, =0x20023\n bkpt 0xab"); /* SYS_EXIT, an internal error */
  for (;;) {
  }
}
