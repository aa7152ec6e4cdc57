#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace waymark {

/// Category of an expected failure. Bugs trigger assertions instead, and "nothing detected" is an empty
/// value, not an error.
enum class ErrorCode : std::uint8_t {
  InvalidArgument,  ///< a value outside its documented range, or values that contradict each other
  NotFound,         ///< a missing file, key, tag or topic
  Unreadable,       ///< input that exists but cannot be decoded (truncated, wrong format, hostile)
  Unwritable,       ///< output that cannot be created or completed
  Unsupported,      ///< valid input that this build cannot handle
  LimitExceeded,    ///< requires more memory, time or pixels than allowed
};

/// The name of an error code in JSON summaries ("invalid_argument", …).
[[nodiscard]] const char* to_string(ErrorCode code);

/// Location of an error. Only the fields that apply are set.
struct Place {
  std::string source = {};                ///< file path or other name of the input
  std::optional<std::int64_t> line = {};  ///< 1-based line of a text file
  std::optional<std::int64_t> byte = {};  ///< 0-based offset in a binary file
  /// Dotted key of a value in the source or, without a source, the name of a field in an option or job
  /// struct. If a field names an entry that is missing from the source, the field follows in backticks: "map
  /// (`route`)".
  std::string key = {};

  friend bool operator==(const Place&, const Place&) = default;
};

/// An expected failure: what is wrong, where, and how to fix it.
struct Error {
  ErrorCode code = ErrorCode::InvalidArgument;
  std::string message;    ///< one sentence that describes what is wrong, without the place
  Place place = {};       ///< where
  std::string hint = {};  ///< one sentence that describes how to fix it; may be empty
};

/// "lap.yaml:12 (camera.fx): negative focal length -3. Give a value in pixels greater than 0."
[[nodiscard]] std::string to_string(const Error& error);

/// A value, or the Error that explains why there is none. Exceptions never cross room boundaries.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using Base = tl::expected<T, Error>;
  using Base::Base;
  // NOLINTNEXTLINE(google-explicit-constructor): converts the result of map() back to a Result
  Result(Base base) : Base(std::move(base)) {}
};

/// Success or an Error, for functions that return no value.
using Status = Result<void>;

/// `return fail(ErrorCode::NotFound, "no such file", {.source = path}, "Check the path.");`
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message, Place place = {},
                                                std::string hint = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(place), std::move(hint)});
}

/// Hint for an errno set while writing a file to `folder`; empty if there is no hint for this errno.
[[nodiscard]] std::string write_hint(int error, const std::string& folder);

}  // namespace waymark
