#include "waymark/cli/lone_anchor_flags.hpp"

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/live/start_recording.hpp"

namespace waymark::cli {

void add_flags(CLI::App& app, LoneAnchorFlags& flags) {
  app.add_option("--anchor", flags.anchor,
                 "Anchor tag of the map with --robot process, for example tag36h11:0, or its id; it must be "
                 "in view where the lap begins and ends")
      ->type_name("TAG");
  app.add_option("--tag-size-m", flags.tag_size_m, "With --robot process: side of the tags' black squares")
      ->check(CLI::Range(0.001, 10.0))
      ->type_name("FLOAT");
}

Status check_live_setup(RobotSetup& setup, const LoneAnchorFlags& flags) {
  if (setup.process.empty() || !setup.world_yaml.empty()) {
    if (flags.anchor.empty() && flags.tag_size_m == 0) return {};
    return fail(ErrorCode::InvalidArgument, "the world already says what its tags are",
                {.key = flags.anchor.empty() ? "--tag-size-m" : "--anchor"},
                "Leave it out, or --world with --robot process:CMD.");
  }
  if (flags.anchor.empty() || flags.tag_size_m == 0)
    return fail(ErrorCode::InvalidArgument, "the anchor and the size of the tags are not known",
                {.key = flags.anchor.empty() ? "--anchor" : "--tag-size-m"},
                "For example --anchor 0 --tag-size-m 0.16.");
  const auto anchor = tag_named(flags.anchor);
  if (!anchor) return tl::unexpected(anchor.error());
  place_lone_anchor(setup.simulated.world, *anchor, flags.tag_size_m);
  return {};
}

}  // namespace waymark::cli
