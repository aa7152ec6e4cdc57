#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "waymark/app/common/camera_moment.hpp"
#include "waymark/localization/method.hpp"

/// One line about where a robot or a camera is or was (`waymark localize`), each with its end.
namespace waymark {

/// `since_s`: from the first line on.
[[nodiscard]] std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate);
/// The keys of `--json` (docs/reference/cli.md).
[[nodiscard]] std::string estimate_json(SensorTime now, const std::optional<LocalizationEstimate>& estimate);

[[nodiscard]] std::string moment_line(double since_s, const CameraMoment& moment);
[[nodiscard]] std::string moment_json(const CameraMoment& moment);

/// The lines of moments that come one after the other, one every so often in their own time.
class MomentLines {
 public:
  MomentLines(double every_s, bool json, std::function<void(const std::string&)> print)
      : every_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(every_s))),
        json_(json),
        print_(std::move(print)) {}

  void take(const CameraMoment& moment);

 private:
  Duration every_;
  bool json_;
  std::function<void(const std::string&)> print_;
  std::optional<SensorTime> first_{};
  SensorTime next_{};
};

}  // namespace waymark
