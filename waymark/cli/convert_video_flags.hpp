#pragma once

#include <string>

#include <CLI/App.hpp>

#include "waymark/cli/console.hpp"
#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/pose_flags.hpp"
#include "waymark/jobs/convert_video.hpp"

namespace waymark::cli {

/// The flags of `waymark convert` that are about videos: camera, tag size, detector, --pictures. Must stay
/// where it is while the command line is parsed.
class ConvertVideoFlags {
 public:
  explicit ConvertVideoFlags(CLI::App& verb);

  /// Fails where one of them was given: the input is no video.
  [[nodiscard]] Status check_unused() const;
  /// Writes the tags of a video to a recording, and says what became of it.
  [[nodiscard]] ExitCode convert(const std::string& input, const std::string& output, bool json,
                                 Console& console) const;
  /// The same of a live camera, until --duration-s is over or Ctrl-C.
  [[nodiscard]] ExitCode record(const std::string& address, const std::string& output, bool json,
                                Console& console) const;

 private:
  /// The job by the flags, and the detector.
  struct Prepared {
    ConvertVideoJob job{};
    TagFinder finder{};
  };
  [[nodiscard]] Result<Prepared> prepare(const std::string& input, const std::string& output) const;

  const CLI::App& app_;
  Settings settings_;
  PoseFlags poses_;
  DetectorFlags detector_;
  std::string pictures_;
  double duration_s_ = 0;
};

}  // namespace waymark::cli
