#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/cli/loop_steps.hpp"
#include "waymark/cli/pilot.hpp"

namespace waymark {
class LiveFeed;
}

/// The operator's story with a robot that lives: teach, map, replay, with one button.
namespace waymark::cli {

struct StoryJob {
  std::filesystem::path folder;  ///< of what is written: lap.mcap, map/, replay.mcap
  std::string map{};             ///< folder of a map that is there already: the story begins with ready
  std::string driver = "gamepad";
  double speed_m_s = kUsualSpeed_m_s;
  std::string images{};      ///< how pictures are recorded: raw, jpeg; empty: not at all
  ReplayJob replay{};        ///< method, options; folder and output are the story's
  LiveFeed* feed = nullptr;  ///< of viewers, if there are any
};

struct StoryReport {
  int laps_taught = 0;
  std::vector<double> mapping_s{};  ///< from the end of each lap to its map
  bool map_failed = false;          ///< the last lap could not be mapped
  std::vector<ReplayReport> replays{};
  bool interrupted = false;
  std::string state{};   ///< the last one
  std::string reason{};  ///< of the last stop or failure
  double wall_s = 0;
};

/// Runs the story until the pilot ends it, or Ctrl-C. The stage must have a process.
[[nodiscard]] Result<StoryReport> run_story(const Stage& stage, const StoryJob& job, Console& console);
/// The same with somebody in charge who is there already; `driver` is then a name for the recordings.
[[nodiscard]] Result<StoryReport> run_story(const Stage& stage, const StoryJob& job,
                                            std::unique_ptr<Pilot> pilot, Console& console);
[[nodiscard]] nlohmann::ordered_json to_json(const StoryReport& report);

}  // namespace waymark::cli
