#pragma once

#include <CLI/App.hpp>

#include "waymark/cli/console.hpp"
#include "waymark/jobs/map_video_description.hpp"

namespace waymark::cli {

struct MapArgs;

/// The flags of `waymark map` that are about videos. Must stay where it is while the command line is parsed.
class MapVideoFlags {
 public:
  explicit MapVideoFlags(CLI::App& app);

  /// Whether the lap is a video.
  [[nodiscard]] bool takes(const MapArgs& args) const;
  /// Maps the tags of videos, and says what became of it.
  [[nodiscard]] ExitCode map(const MapArgs& args, Console& console) const;

 private:
  [[nodiscard]] Result<MapVideoJob> job_of(const MapArgs& args) const;

  CLI::App& app_;
  MapVideoDescription of_{};
};

}  // namespace waymark::cli
