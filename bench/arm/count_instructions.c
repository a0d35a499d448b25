// A plug-in of qemu: counts the instructions that a program executes between two marks, and writes each count to a file, one a line.
//
// qemu-aarch64 -plugin count_instructions.so,counts=COUNTS PROGRAM: a mark is a system call of a number that no kernel has: MARK with 1
// begins an interval, with 0 ends it (count.cpp).
//
// qemu-system-arm -plugin count_instructions.so,counts=COUNTS,mark=ADDRESS: without an operating system a mark is a call of the function
// at this address; each writes what has been executed since the one before (bench/embedded/).
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// What is used of qemu's interface; Debian ships no header for it.
typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                           void (*translated)(qemu_plugin_id_t, struct qemu_plugin_tb *));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *block, void (*executed)(unsigned, void *),
                                          int registers, void *data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *block, size_t i);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *instruction);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *instruction, void (*executed)(unsigned, void *),
                                            int registers, void *data);
void qemu_plugin_register_vcpu_syscall_cb(qemu_plugin_id_t id,
                                          void (*called)(qemu_plugin_id_t, unsigned, int64_t number, uint64_t, uint64_t,
                                                         uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t));

#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = 1;

enum { MARK = 0x4b534c };
static uint64_t instructions; // of one thread: programs that are counted have no other
static uint64_t mark_address;
static FILE *counts;

static void write_count(void) { fprintf(counts, "%" PRIu64 "\n", instructions), fflush(counts); }

static void marked(unsigned cpu, void *unused) {
  (void)cpu, (void)unused;
  write_count();
  instructions = 0;
}

static void executed(unsigned cpu, void *n) {
  (void)cpu;
  instructions += (uintptr_t)n;
}

// A block of translated code is executed from its first instruction to its last, unless one of them faults.
static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_cb(block, executed, 0, (void *)(uintptr_t)qemu_plugin_tb_n_insns(block));
  struct qemu_plugin_insn *const first = qemu_plugin_tb_get_insn(block, 0); // what is called begins a block
  if (mark_address && qemu_plugin_insn_vaddr(first) == mark_address)
    qemu_plugin_register_vcpu_insn_exec_cb(first, marked, 0, NULL);
}

static void called(qemu_plugin_id_t id, unsigned cpu, int64_t number, uint64_t begins, uint64_t b, uint64_t c,
                   uint64_t d, uint64_t e, uint64_t f, uint64_t g, uint64_t h) {
  (void)id, (void)cpu, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h;
  if (number != MARK)
    return;
  if (!begins)
    write_count();
  instructions = 0;
}

EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const void *info, int argc, char **argv) {
  (void)info;
  if (argc == 2 && strncmp(argv[1], "mark=", 5) == 0)
    mark_address = strtoull(argv[1] + 5, NULL, 0), --argc;
  if (argc != 1 || strncmp(argv[0], "counts=", 7) != 0 || !(counts = fopen(argv[0] + 7, "w"))) {
    fputs("count_instructions.so,counts=COUNTS: the file for the counts is missing, or can't be written\n", stderr);
    return 1;
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  if (!mark_address)
    qemu_plugin_register_vcpu_syscall_cb(id, called);
  return 0;
}
