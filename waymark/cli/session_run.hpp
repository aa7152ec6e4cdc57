#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/cli/loop_steps.hpp"
#include "waymark/live/session_files.hpp"
#include "waymark/runtime/operator_session.hpp"

namespace waymark {
class LiveFeed;
}

/// The operator's session with its files: teach, map, replay, with one button.
namespace waymark::cli {

/// map_recording() without a word.
[[nodiscard]] Status map_quietly(const std::string& lap, const std::filesystem::path& folder);

struct SessionJob {
  std::filesystem::path folder;  ///< of what is written: lap.mcap, map/, replay.mcap
  std::string map{};             ///< folder of a map that is there already: the session begins with ready
  std::string driver = "gamepad";
  double speed_m_s = kUsualSpeed_m_s;
  std::string images{};  ///< how pictures are recorded: raw, jpeg; empty: not at all
  ReplayJob replay{};    ///< method, options; folder and output are the session's
  MapMaker make_map = map_quietly;
  LiveFeed* feed = nullptr;  ///< of viewers, if there are any
};

struct SessionReport {
  int laps_taught = 0;
  std::vector<double> mapping_s{};  ///< from the end of each lap to its map
  bool map_failed = false;          ///< the last lap could not be mapped
  std::vector<ReplayReport> replays{};
  bool interrupted = false;
  std::string state{};   ///< the last one
  std::string reason{};  ///< of the last stop or failure
  double wall_s = 0;
};

/// Runs the session until the operator ends it, or Ctrl-C. The setup must have a process.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                Console& console);
/// The same with an input that is there already; `driver` is then a name for the recordings.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                std::unique_ptr<OperatorInput> input, Console& console);
[[nodiscard]] nlohmann::ordered_json to_json(const SessionReport& report);

}  // namespace waymark::cli
