#pragma once

#include <exception>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "waymark/base/error.hpp"

namespace waymark::python {

namespace py = pybind11;

/// Carries an Error to Python, where it becomes an exception from waymark.errors.
class Raised final : public std::exception {
 public:
  explicit Raised(Error error) : error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.message.c_str(); }

 private:
  Error error_;
};

/// The value of a Result; raises its error if it has none.
template <class T>
[[nodiscard]] T value_of(Result<T> result) {
  if (!result) throw Raised(std::move(result.error()));
  return std::move(*result);
}

/// Like value_of(), for an argument whose Python name differs from the program's flag.
template <class T>
[[nodiscard]] T value_of(Result<T> result, const char* argument) {
  if (!result) result.error().place.key = argument;
  return value_of(std::move(result));
}

/// Raises the error of a Status.
void check(const Status& status);

/// Raises InvalidArgument with `message` about the argument `key` and a hint.
[[noreturn]] void refuse(const std::string& key, const std::string& message, const std::string& hint = {});

/// "an int", "a list": the name of a type with its article.
[[nodiscard]] std::string with_article(const std::string& type);

/// Registers the translation of Raised to Python exceptions.
void bind_errors();

/// Carries a Python exception from a callback through C++ code as an Error, and re-raises it afterwards.
class PendingException {
 public:
  /// Runs `call`; if it raises, the returned Error ends the calling job.
  template <class Call>
  auto guard(Call&& call) -> decltype(call()) {
    try {
      return std::forward<Call>(call)();
    } catch (...) {
      if (!pending_) pending_ = std::current_exception();  // the first one is the cause
      return fail(ErrorCode::InvalidArgument, "a Python callback raised an exception");
    }
  }
  /// Re-raises the exception from a callback, if any. Requires the GIL.
  void rethrow() {
    if (pending_) std::rethrow_exception(std::exchange(pending_, nullptr));
  }

 private:
  std::exception_ptr pending_{};
};

}  // namespace waymark::python
