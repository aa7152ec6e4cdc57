#pragma once

#include <utility>

#include <pybind11/pybind11.h>

#include "python/bindings/errors.hpp"
#include "waymark/app/common/job_control.hpp"

namespace waymark::python {

/// Runs a job without the GIL, reports its progress to Python, and stops on Ctrl-C or if the callback raises
/// an exception.
class PythonJob {
 public:
  explicit PythonJob(py::object progress) : progress_(std::move(progress)) {}
  PythonJob(const PythonJob&) = delete;
  PythonJob& operator=(const PythonJob&) = delete;

  [[nodiscard]] JobControl control() {
    JobControl control;
    control.progress = [this](const JobProgress& now) { report(now); };
    control.cancelled = [this] { return cancelled(); };
    return control;
  }
  /// Re-raises the exception of the callback, or raises KeyboardInterrupt.
  void rethrow() { pending_.rethrow(); }

 private:
  void report(const JobProgress& now) {
    if (failed_) return;
    const py::gil_scoped_acquire acquire;
    if (progress_.is_none()) return;
    failed_ = !pending_.guard([&]() -> Status {
      progress_(now.text, now.done, now.all);
      return {};
    });
  }
  bool cancelled() {
    if (failed_) return true;
    const py::gil_scoped_acquire acquire;
    failed_ = !pending_.guard([&]() -> Status {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return {};
    });
    return failed_;
  }

  py::object progress_;
  PendingException pending_{};
  bool failed_ = false;
};

}  // namespace waymark::python
