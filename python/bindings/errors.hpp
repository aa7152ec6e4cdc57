#pragma once

#include <exception>
#include <utility>

#include <pybind11/pybind11.h>

#include "waymark/base/error.hpp"

namespace waymark::python {

namespace py = pybind11;

/// An Error on its way to Python, where it becomes an exception of waymark.errors.
class Raised final : public std::exception {
 public:
  explicit Raised(Error error) : error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.message.c_str(); }

 private:
  Error error_;
};

/// The value of a Result; raises its error.
template <class T>
[[nodiscard]] T value_of(Result<T> result) {
  if (!result) throw Raised(std::move(result.error()));
  return std::move(*result);
}

/// The same, of what an argument of Python names, which has another name than the flag of the program.
template <class T>
[[nodiscard]] T value_of(Result<T> result, const char* argument) {
  if (!result) result.error().place.key = argument;
  return value_of(std::move(result));
}

/// Raises the error of a Status.
void check(const Status& status);

/// Raises InvalidArgument: `message` of the argument `key`, and how to mend it.
[[noreturn]] void refuse(const std::string& key, const std::string& message, const std::string& hint = {});

/// Lets Raised arrive in Python.
void bind_errors();

/// An exception that Python raised in a callback travels through C++ as an Error, and goes on afterwards.
class PendingException {
 public:
  /// Runs `call`, which may raise; the Error then ends whatever called it.
  template <class Call>
  auto guard(Call&& call) -> decltype(call()) {
    try {
      return std::forward<Call>(call)();
    } catch (...) {
      if (!pending_) pending_ = std::current_exception();  // the first one is the cause
      return fail(ErrorCode::InvalidArgument, "a Python callback raised an exception");
    }
  }
  /// Raises what a callback raised. Needs the GIL.
  void rethrow() {
    if (pending_) std::rethrow_exception(std::exchange(pending_, nullptr));
  }

 private:
  std::exception_ptr pending_{};
};

}  // namespace waymark::python
