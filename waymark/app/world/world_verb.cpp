#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

Verb world_verb() {
  return {.name = "world",
          .sentence = "Check, make, import or export a simulated world",
          .help = "Example:\n  waymark world check circuit24\n",
          .verbs = {world_check_verb(), world_new_verb(), world_from_recording_verb(), world_export_verb(),
                    world_import_verb(), world_orbit_verb()}};
}

}  // namespace waymark::cli
