#include "waymark/cli/mbot_sim_flags.hpp"

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/settings.hpp"
#include "waymark/drivers/mbot/presence.hpp"

namespace waymark::cli {

MbotSimFlags::MbotSimFlags(CLI::App& app) {
  app.add_option(
         "--mbot", address,
         "Be an MBot on LCM at this address, in real time, until Ctrl-C: udpm://239.255.76.67:7667?ttl=0")
      ->excludes("--limo")
      ->type_name("ADDRESS");
  app.add_option(
         "--mbot-generation", generation,
         "Publisher of tags of the MBot: jetson (quaternions x, y, z, w) or pi5 (w, x, y, z; no stamps)")
      ->check(CLI::IsMember({"jetson", "pi5"}))
      ->needs("--mbot")
      ->capture_default_str()
      ->type_name("NAME")
      ->group(kMoreGroup);
}

Status MbotSimFlags::run(Plant& plant, const SimulatedSetup& setup) const {
  if (setup.pictures)
    return fail(ErrorCode::InvalidArgument, "an MBot sends no pictures over LCM, but the poses of tags",
                {.key = "--images"}, "Leave it out.");
  if (Status alone = no_mbot_at(address); !alone) return alone;
  const auto link = open_lcm(address);
  if (!link) return tl::unexpected(link.error());
  const MbotGeneration publisher = generation == "pi5" ? MbotGeneration::Pi5 : MbotGeneration::Jetson;
  return run_mbot_robot_sim(**link, plant, setup, publisher, interrupted);
}

}  // namespace waymark::cli
