#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/recording/sample_reader.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A whole recording in memory: what making a map of a lap needs.
struct RecordedLap {
  RecordingSetup setup{};
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};
  Trajectory truth{};                                ///< empty when nobody knew it
  std::map<std::string, std::string> attachments{};  ///< their bytes, by name
};

/// Reads all of it. A file that was cut or is still being written is read as far as it goes, and
/// `setup.problems` says so. Fails on what is not a recording and on a message that does not decode.
[[nodiscard]] Result<RecordedLap> read_lap(const ByteSource& source);

}  // namespace waymark
