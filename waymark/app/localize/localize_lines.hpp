#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/base/time.hpp"
#include "waymark/localization/method.hpp"

/// Prints the pose of a robot or a camera as lines of text or JSON, each ending with a newline. `since_s` is
/// the time since the first line.
namespace waymark {

/// The newest estimate at the time a line is printed.
struct EstimateMoment {
  SensorTime now{};  ///< time on the robot's clock
  std::optional<LocalizationEstimate> estimate{};
};

[[nodiscard]] std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate);
[[nodiscard]] std::string moment_line(double since_s, const CameraMoment& moment);

// Fields of a `--json` line.
[[nodiscard]] ReportFields fields(const EstimateMoment& moment);
[[nodiscard]] ReportFields fields(const LocalizationEstimate& estimate);
[[nodiscard]] ReportFields fields(const CameraMoment& moment);

/// Prints one line per estimate.
class EstimateLines {
 public:
  EstimateLines(bool json, std::function<void(const std::string&)> print)
      : json_(json), print_(std::move(print)) {}

  void take(SensorTime now, const std::optional<LocalizationEstimate>& estimate);

 private:
  bool json_;
  std::function<void(const std::string&)> print_;
  std::optional<SensorTime> first_{};
};

/// Prints at most one line per `every_s`, according to the timestamps of the moments.
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
