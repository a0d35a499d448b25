// The interpreter's lock, released while a batch runs.
#pragma once

#include <Python.h>

#include <unistd.h>

/// Releases the lock until it is destroyed.
///
/// A daemon thread may ask for the lock when the interpreter has ended.  Python up to 3.13 then ends that thread by
/// pthread_exit, which unwinds the stack as an exception does: it would meet functions that must not throw, this destructor
/// first of all, and std::terminate would abort the program.  The unwinding is therefore caught, and the thread waits for
/// the end of the program, as Python 3.14 lets it wait.
class without_gil {
public:
  without_gil() : state_(PyEval_SaveThread()) {}
  ~without_gil() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) { // must not end: a forced unwinding that is not continued is a fatal error
      for (;;)
        pause();
    }
  }
  without_gil(const without_gil &) = delete;
  without_gil &operator=(const without_gil &) = delete;

private:
  PyThreadState *state_;
};
