#include "python/bindings/errors.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include <pybind11/stl.h>

namespace waymark::python {
namespace {

/// The class of waymark.errors for a code.
const char* class_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
      return "InvalidArgument";
    case ErrorCode::NotFound:
      return "NotFound";
    case ErrorCode::Unreadable:
      return "Unreadable";
    case ErrorCode::Unwritable:
      return "Unwritable";
    case ErrorCode::Unsupported:
      return "Unsupported";
    case ErrorCode::LimitExceeded:
      return "LimitExceeded";
  }
  return "Error";
}

/// Flags of the program as keywords of Python: --tag-size-m is tag_size_m.
std::string with_keywords(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) {
    const bool begins = at == 0 || std::string_view(" '(`").find(text[at - 1]) != std::string_view::npos;
    std::size_t end = at + 2;
    while (end < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '-'))
      ++end;
    if (!begins || end == at + 2) {
      at += 2;
      continue;
    }
    std::replace(text.begin() + static_cast<std::ptrdiff_t>(at),
                 text.begin() + static_cast<std::ptrdiff_t>(end), '-', '_');
    text.erase(at, 2);
  }
  return text;
}

void raise(Error error) {
  error.message = with_keywords(std::move(error.message));
  error.hint = with_keywords(std::move(error.hint));
  error.place.key = with_keywords(std::move(error.place.key));
  const py::object type = py::module_::import("waymark.errors").attr(class_of(error.code));
  const py::object exception = type(to_string(error));
  exception.attr("message") = error.message;
  exception.attr("hint") = error.hint;
  exception.attr("source") = error.place.source;
  exception.attr("line") = error.place.line;
  exception.attr("byte") = error.place.byte;
  exception.attr("key") = error.place.key;
  PyErr_SetObject(type.ptr(), exception.ptr());
}

}  // namespace

void check(const Status& status) {
  if (!status) throw Raised(status.error());
}

void refuse(const std::string& key, const std::string& message, const std::string& hint) {
  throw Raised({.code = ErrorCode::InvalidArgument, .message = message, .place = {.key = key}, .hint = hint});
}

void bind_errors() {
  py::register_exception_translator([](std::exception_ptr exception) {
    try {
      if (exception) std::rethrow_exception(exception);
    } catch (const Raised& raised) {
      try {
        raise(raised.error());
      } catch (py::error_already_set& other) {  // the interpreter is shutting down, say
        other.restore();
      }
    }
  });
}

}  // namespace waymark::python
