#include "waymark/app/cli/failure.hpp"

#include "waymark/app/cli/options_flags.hpp"

namespace waymark::cli {

Error naming_flag(Error error) {
  if (error.place.source.empty() && !error.place.key.empty() && !error.place.key.starts_with('-'))
    error.place.key = flag_name(error.place.key);
  return error;
}

ExitCode exit_code_of(const Error& error) {
  const bool given_wrong = error.place.key.starts_with("--") || error.place.source == "environment";
  return given_wrong ? ExitCode::Usage : ExitCode::SomeFailed;
}

ExitCode fail_with(const Error& error, Console& console) {
  const Error named = naming_flag(error);
  return console.failed(named, exit_code_of(named));
}

ExitCode fail_by_kind(const Error& error, Console& console) {
  return error.code == ErrorCode::InvalidArgument ? fail_usage(error, console) : fail_with(error, console);
}

ExitCode fail_usage(const Error& error, Console& console) {
  return console.failed(naming_flag(error), ExitCode::Usage);
}

}  // namespace waymark::cli
