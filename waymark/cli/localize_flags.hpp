#pragma once

#include "waymark/jobs/localize_log.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flags of `waymark localize` that say where things come from. `job` must stay where it is while the
/// command line is parsed.
void add_localize_flags(CLI::App& app, LocalizeJob& job);

}  // namespace waymark::cli
