#include "python/bindings/errors.hpp"

#include <algorithm>
#include <regex>
#include <string>
#include <utility>

#include <pybind11/stl.h>

namespace waymark::python {
namespace {

/// Name of the class in waymark.errors for an error code.
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

/// In messages, field names are between backticks. They are valid Python keywords as they are (`tag_size_m`),
/// but in commands they become flags: `waymark map LAP extend=MAP` becomes `waymark map LAP --extend MAP`.
std::string with_keywords(const std::string& text) {
  static const std::regex kCommand("`waymark [^`]*`");
  static const std::regex kField("`([a-z][a-z0-9_]*(=[^`]*)?)`");
  static const std::regex kAssignment(" ([a-z][a-z0-9_]*)=(\\S*[^`\\s])");
  std::string written;
  auto from = text.cbegin();
  for (std::sregex_iterator command(text.begin(), text.end(), kCommand), end; command != end; ++command) {
    written += std::regex_replace(std::string(from, text.cbegin() + command->position()), kField, "$1");
    for (std::string word = command->str(); !word.empty();) {
      std::smatch found;
      if (!std::regex_search(word, found, kAssignment)) {
        written += word;
        break;
      }
      std::string flag = found[1];
      std::ranges::replace(flag, '_', '-');
      written += found.prefix().str() + " --" + flag + (found[2] == "true" ? "" : " " + found[2].str());
      word = found.suffix();
    }
    from = text.cbegin() + command->position() + command->length();
  }
  return written + std::regex_replace(std::string(from, text.cend()), kField, "$1");
}

void raise(Error error) {
  error.message = with_keywords(error.message);
  error.hint = with_keywords(error.hint);
  error.place.key = with_keywords(error.place.key);
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

std::string with_article(const std::string& type) {
  const bool vowel = std::string("aeiouAEIOU").find(type.substr(0, 1)) != std::string::npos;
  return (vowel ? "an " : "a ") + type;
}

void bind_errors() {
  py::register_exception_translator([](std::exception_ptr exception) {
    try {
      if (exception) std::rethrow_exception(exception);
    } catch (const Raised& raised) {
      try {
        raise(raised.error());
      } catch (py::error_already_set& other) {  // for example if the interpreter is shutting down
        other.restore();
      }
    }
  });
}

}  // namespace waymark::python
