// The interpreter's lock, released while a batch runs, and taken while Python functions are called.
//
// A daemon thread may ask for the lock when the interpreter has ended.  Python up to 3.13 then ends that thread by
// pthread_exit, which unwinds the stack as an exception does.  It would meet functions that must not throw, and destructors of
// Python objects.  The unwinding is therefore caught, and the thread waits for the end of the program, as Python 3.14 lets it
// wait.
#pragma once

#include <Python.h>

#include <chrono>
#include <thread>

/// For ever.  Must not end: a forced unwinding that is not continued is a fatal error.
[[noreturn]] inline void wait_for_the_end_of_the_program() {
  for (;;)
    std::this_thread::sleep_for(std::chrono::hours(1));
}

/// The result of a Python function, or null with an error set.  Temporary objects of the caller's expression would be
/// destroyed while the thread is unwound, without the lock: give objects that live longer than the call.
template <class... Objects> PyObject *call_python(PyObject *function, Objects... arguments) {
  try {
    return PyObject_CallFunctionObjArgs(function, arguments..., nullptr);
  } catch (...) { // nothing in Python throws: the thread is being ended
    wait_for_the_end_of_the_program();
  }
}

/// Releases the lock until it is destroyed.
class without_gil {
public:
  without_gil() : state_(PyEval_SaveThread()) {}
  ~without_gil() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      wait_for_the_end_of_the_program();
    }
  }
  without_gil(const without_gil &) = delete;
  without_gil &operator=(const without_gil &) = delete;

private:
  PyThreadState *state_;
};
