#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {

Status refuse_flag(const CLI::App& app, const std::string& flag, const std::string& why,
                   const std::string& hint) {
  const CLI::Option* option = app.get_option_no_throw(flag);
  if (option == nullptr || option->count() == 0) return {};
  return fail(ErrorCode::InvalidArgument, why, {.key = flag}, hint);
}

}  // namespace waymark::cli
