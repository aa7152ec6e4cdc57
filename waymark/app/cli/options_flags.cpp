#include "waymark/app/cli/options_flags.hpp"

namespace waymark::cli {

GivenFlags given_on(const CLI::App& app) {
  return [&app](const char* flag) {
    const CLI::Option* option = app.get_option_no_throw(flag);
    return option != nullptr && option->count() > 0;
  };
}

}  // namespace waymark::cli
