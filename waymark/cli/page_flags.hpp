#pragma once

#include "waymark/live/live_page.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace waymark::cli {

/// The flags of every verb that serves the page. With `view`, they mean something only where it is given.
void add_flags(CLI::App& app, PageOptions& page, CLI::Option* view = nullptr);

/// --view, --publish-ros2, and their flags.
void add_flags(CLI::App& app, ViewerOptions& flags);

}  // namespace waymark::cli
