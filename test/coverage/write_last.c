/* Linked into instrumented programs: writes the counters once more when everything else has ended, also what runs when the
   library's own objects are destroyed. */
int __llvm_profile_write_file(void);
__attribute__((destructor)) static void write_last(void) { __llvm_profile_write_file(); }
