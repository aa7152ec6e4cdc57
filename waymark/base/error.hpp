#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace waymark {

/// What kind of expected failure it was. A bug asserts instead; "nothing seen" is an empty value, not an
/// error.
enum class ErrorCode : std::uint8_t {
  InvalidArgument,  ///< a value outside its documented range, or values that contradict each other
  NotFound,         ///< a file, key, tag or topic that is not there
  Unreadable,       ///< input that exists but cannot be decoded (truncated, wrong format, hostile)
  Unwritable,       ///< output that cannot be created or completed
  Unsupported,      ///< valid input of a kind this build does not handle
  LimitExceeded,    ///< would need more memory, time or pixels than allowed
};

/// The word for a code, as it appears in JSON summaries ("invalid_argument", …).
[[nodiscard]] const char* to_string(ErrorCode code);

/// Where it happened: whatever of file, line, byte and key is known.
struct Place {
  std::string source = {};                ///< file path or other name of the input
  std::optional<std::int64_t> line = {};  ///< 1-based line of a text file
  std::optional<std::int64_t> byte = {};  ///< 0-based offset in a binary file
  /// Dotted key of a value in the source; without a source the field of an option or job struct. A field
  /// that names what the source lacks stands between backticks beside it: "map (`route`)".
  std::string key = {};

  friend bool operator==(const Place&, const Place&) = default;
};

/// An expected failure: what, where, and how to mend it.
struct Error {
  ErrorCode code = ErrorCode::InvalidArgument;
  std::string message;    ///< what is wrong, one sentence without the place
  Place place = {};       ///< where
  std::string hint = {};  ///< how to mend it, one sentence; may be empty
};

/// "lap.yaml:12 (camera.fx): negative focal length -3. Give a value in pixels greater than 0."
[[nodiscard]] std::string to_string(const Error& error);

/// A value or the Error that explains why there is none. No exceptions cross room borders.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using Base = tl::expected<T, Error>;
  using Base::Base;
  // NOLINTNEXTLINE(google-explicit-constructor): what map() gives becomes a Result again
  Result(Base base) : Base(std::move(base)) {}
};

/// Success or an Error, for what has no value to give back.
using Status = Result<void>;

/// `return fail(ErrorCode::NotFound, "no such file", {.source = path}, "Check the path.");`
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message, Place place = {},
                                                std::string hint = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(place), std::move(hint)});
}

/// How to mend what errno says of a file that was to be written into `folder`; empty where that is not known.
[[nodiscard]] std::string write_mend(int error, const std::string& folder);

}  // namespace waymark
