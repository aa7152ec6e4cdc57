#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/cli/console.hpp"
#include "waymark/jobs/map_video.hpp"

namespace waymark::cli {

struct MapArgs;

/// The flags of `waymark map` that are about videos. Must stay where it is while the command line is parsed.
class MapVideoFlags {
 public:
  explicit MapVideoFlags(CLI::App& app);

  /// Whether the lap is a video.
  [[nodiscard]] static bool takes(const MapArgs& args);
  /// Fails where one of them was given: the lap is no video.
  [[nodiscard]] Status check_unused() const;
  /// Maps the tags of videos, and says what became of it.
  [[nodiscard]] ExitCode map(const MapArgs& args, Console& console) const;

 private:
  [[nodiscard]] Result<MapVideoJob> job_of(const MapArgs& args) const;

  /// What is known of the place: anchors, distances, what is level.
  [[nodiscard]] Status read_place(const MapArgs& args, MapVideoJob& job) const;
  /// The camera, its uncertainty and its shutter.
  [[nodiscard]] Result<MapVideoJob> read_camera_of_job() const;

  CLI::App& app_;
  std::string camera_;
  std::string camera_name_;
  std::optional<double> readout_ms_;
  double tag_size_sigma_m_ = 0.0005;
  std::optional<double> prior_sigma_m_, prior_sigma_deg_;
  std::vector<std::string> distances_, upright_, floor_, planes_;
  double level_sigma_deg_ = 1;
};

}  // namespace waymark::cli
