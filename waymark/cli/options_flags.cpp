#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {

Status refuse_flag(const CLI::App& app, const std::string& flag, const std::string& why,
                   const std::string& hint) {
  const CLI::Option* option = app.get_option_no_throw(flag);
  if (option == nullptr || option->count() == 0) return {};
  return fail(ErrorCode::InvalidArgument, why, {.key = flag}, hint);
}

void Refusals::flags(bool when, std::initializer_list<const char*> names, const std::string& why,
                     const std::string& hint) {
  for (const char* name : names)
    if (when && status_) status_ = refuse_flag(app_, name, why, hint);
}

}  // namespace waymark::cli
