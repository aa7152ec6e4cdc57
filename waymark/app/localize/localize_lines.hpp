#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/base/time.hpp"
#include "waymark/localization/method.hpp"

/// One line about where a robot or a camera is or was, as text and as JSON; each with its end.
/// `since_s`: from the first line on.
namespace waymark {

/// Where a robot is by now.
struct EstimateMoment {
  SensorTime now{};  ///< by the robot's clock
  std::optional<LocalizationEstimate> estimate{};
};

[[nodiscard]] std::string estimate_line(double since_s, const std::optional<LocalizationEstimate>& estimate);
[[nodiscard]] std::string moment_line(double since_s, const CameraMoment& moment);

// What a line of `--json` holds.
[[nodiscard]] ReportFields fields(const EstimateMoment& moment);
[[nodiscard]] ReportFields fields(const LocalizationEstimate& estimate);
[[nodiscard]] ReportFields fields(const CameraMoment& moment);

/// The lines of estimates, all of which are printed.
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
