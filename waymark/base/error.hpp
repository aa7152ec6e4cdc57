#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace waymark {

/// Category of an expected failure. A bug asserts instead; "nothing detected" is an empty value, not an
/// error.
enum class ErrorCode : std::uint8_t {
  InvalidArgument,  ///< a value outside its documented range, or values that contradict each other
  NotFound,         ///< a missing file, key, tag or topic
  Unreadable,       ///< input that exists but cannot be decoded (truncated, wrong format, hostile)
  Unwritable,       ///< output that cannot be created or completed
  Unsupported,      ///< valid input of a kind that this build does not handle
  LimitExceeded,    ///< would need more memory, time or pixels than allowed
};

/// Name of a code as it appears in JSON summaries ("invalid_argument", …).
[[nodiscard]] const char* to_string(ErrorCode code);

/// Location of an error. Only the applicable fields of file, line, byte and key are set.
struct Place {
  std::string source = {};                ///< file path or other name of the input
  std::optional<std::int64_t> line = {};  ///< 1-based line of a text file
  std::optional<std::int64_t> byte = {};  ///< 0-based offset in a binary file
  /// Dotted key of a value in the source; without a source, the field of an option or job struct. A
  /// field that names the missing entry of the source is added in backticks: "map (`route`)".
  std::string key = {};

  friend bool operator==(const Place&, const Place&) = default;
};

/// An expected failure: what is wrong, where, and how to fix it.
struct Error {
  ErrorCode code = ErrorCode::InvalidArgument;
  std::string message;    ///< what is wrong, as one sentence without the place
  Place place = {};       ///< where
  std::string hint = {};  ///< how to fix it, as one sentence; may be empty
};

/// "lap.yaml:12 (camera.fx): negative focal length -3. Give a value in pixels greater than 0."
[[nodiscard]] std::string to_string(const Error& error);

/// A value, or the Error that explains why there is none. Exceptions do not cross the borders of a room.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using Base = tl::expected<T, Error>;
  using Base::Base;
  // NOLINTNEXTLINE(google-explicit-constructor): converts the result of map() back to a Result
  Result(Base base) : Base(std::move(base)) {}
};

/// Success or an Error, for functions without a value to return.
using Status = Result<void>;

/// `return fail(ErrorCode::NotFound, "no such file", {.source = path}, "Check the path.");`
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message, Place place = {},
                                                std::string hint = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(place), std::move(hint)});
}

/// Hint for an errno that occurred while writing a file into `folder`; empty if the errno has no hint.
[[nodiscard]] std::string write_hint(int error, const std::string& folder);

}  // namespace waymark
