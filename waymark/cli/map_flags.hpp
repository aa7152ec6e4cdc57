#pragma once

#include <string>

#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/parts.hpp"
#include "waymark/jobs/map_text.hpp"
#include "waymark/jobs/map_words.hpp"

namespace waymark::cli {

/// The flags of `waymark map`. Must stay where it is while the command line is parsed.
struct MapArgs : MapWords {
  explicit MapArgs(CLI::App& verb);

  Settings settings;
  bool json = false;
  OptionFlags<BundleMapOptions> bundle;
  OptionFlags<ChainOptions> chain;
  OptionFlags<LandmarkMapOptions> points;
  OptionFlags<RouteOptions> route;
  DetectorFlags detector;

  /// What is missing (a verb with verbs of its own cannot leave that to the parser), and flags that would be
  /// passed over in silence.
  [[nodiscard]] Status check() const;
  /// Without the maps that are named.
  [[nodiscard]] Result<MapJob> make_job() const;
  /// Refuses options of laps of a robot, where the map is made of something else.
  void refuse_lap_options(Refusals& refused, const char* why, const char* hint) const;
  /// Prints the report of a map and its warnings.
  [[nodiscard]] ExitCode show(const auto& report, Console& console) const {
    console.print(json ? json_line(to_json(report)) : to_text(report, job.folder));
    console.warn(report.warnings);
    return ExitCode::Ok;
  }
  /// With --tagslam.
  [[nodiscard]] Result<MapSceneJob> make_scene_job() const;
};

}  // namespace waymark::cli
