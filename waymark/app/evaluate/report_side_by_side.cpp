#include "waymark/app/evaluate/report_side_by_side.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/profile_table.hpp"
#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

template <class Stamped>
double rate_hz(const std::vector<Stamped>& samples) {
  if (samples.size() < 2) return 0;
  const double seconds = to_seconds(samples.back().stamp - samples.front().stamp);
  return seconds > 0 ? static_cast<double>(samples.size() - 1) / seconds : 0;
}

/// What the camera made of the place.
struct Sight {
  std::size_t tags = 0;
  std::size_t with_two = 0;
  double longest_blind_s = 0;
  std::vector<double> sides_px{};
};

Sight sight_of(const std::vector<TagFrame>& frames) {
  Sight sight;
  SensorTime seen = frames.empty() ? SensorTime{} : frames.front().stamp;
  for (const TagFrame& frame : frames) {
    sight.tags += frame.detections.size();
    if (frame.detections.size() >= 2) ++sight.with_two;
    sight.longest_blind_s = std::max(sight.longest_blind_s, to_seconds(frame.stamp - seen));
    if (!frame.detections.empty()) seen = frame.stamp;
    for (const TagDetection& tag : frame.detections)
      sight.sides_px.push_back((tag.corners_px[1] - tag.corners_px[0]).norm());
  }
  return sight;
}

std::string number(double value, int digits) {
  return value > 0 ? fmt::format("{:.{}f}", value, digits) : "-";
}

/// "sim", "process:…", or where else it came from; "-" when it does not say.
std::string source_of(const DriveRun& drive) {
  const auto made = drive.lap.setup.metadata.find("waymark");
  if (made == drive.lap.setup.metadata.end()) return "-";
  const auto source = made->second.find("source");
  return source == made->second.end() ? "-" : source->second.substr(0, source->second.find(' '));
}

std::vector<std::string> row_of(const DriveRun& drive) {
  const Sight sight = sight_of(drive.lap.frames);
  const auto frames = static_cast<double>(drive.lap.frames.size());
  const auto& odometry = drive.lap.odometry;
  double metres = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    metres += (odometry[i].odom_T_base.translation() - odometry[i - 1].odom_T_base.translation()).norm();
  const double seconds = odometry.size() < 2 ? 0 : to_seconds(odometry.back().stamp - odometry.front().stamp);
  std::vector<double> sigma_mm;
  for (const EstimatedPose& pose : drive.estimate) {
    if (pose.covariance) sigma_mm.push_back(1000 * std::sqrt(pose.covariance->topLeftCorner<2, 2>().trace()));
  }
  return {drive.file,
          source_of(drive),
          number(seconds, 1),
          number(metres, 2),
          number(seconds > 0 ? metres / seconds : 0, 2),
          number(rate_hz(odometry), 1),
          number(rate_hz(drive.lap.frames), 1),
          frames > 0 ? fmt::format("{:.2f}", static_cast<double>(sight.tags) / frames) : "-",
          frames > 0 ? fmt::format("{:.1f}", 100 * static_cast<double>(sight.with_two) / frames) : "-",
          frames > 0 ? fmt::format("{:.2f}", sight.longest_blind_s) : "-",
          number(median(sight.sides_px), 1),
          number(median(std::move(sigma_mm)), 1)};
}

}  // namespace

plot::PageTable side_by_side(const Runs& runs) {
  plot::PageTable table{
      .caption =
          "What each robot sent and detected; no truth is needed. Tags: "
          "mean number a picture, median side of their squares. Sigma: median",
      .head = {"drive", "source", "lasts [s]", "driven [m]", "speed [m/s]", "odometry [Hz]", "camera [Hz]",
               "tags", "two or more [%]", "longest without [s]", "side [px]", "sigma [mm]"}};
  for (const DriveRun& drive : runs.drives) table.rows.push_back(row_of(drive));
  return table;
}

plot::PageTable sensors_side_by_side(const Runs& runs) {
  plot::PageTable table{
      .caption = "How sensors and motors behaved, measured in the same way in each recording",
      .head = {"quantity"}};
  std::vector<const DriveRun*> measured;
  for (const DriveRun& drive : runs.drives)
    if (drive.profile) measured.push_back(&drive);
  if (measured.size() < 2) return table;
  for (const DriveRun* drive : measured) table.head.push_back(drive->file);
  std::vector<std::vector<ProfileRow>> columns;
  for (const DriveRun* drive : measured)
    columns.push_back(profile_table(*measured.front()->profile, *drive->profile));
  std::vector<std::string> keys;  // a row that the first drive lacks may be in another's
  for (const std::vector<ProfileRow>& column : columns) {
    for (const ProfileRow& row : column) {
      if (std::ranges::find(keys, row.key) != keys.end()) continue;
      keys.push_back(row.key);
      table.rows.push_back({row.words});
    }
  }
  for (const std::vector<ProfileRow>& column : columns) {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto row = std::ranges::find(column, keys[i], &ProfileRow::key);
      const bool told = row != column.end() && row->simulation;
      table.rows[i].push_back(told ? fmt::format("{:.4g}", *row->simulation) : "-");
    }
  }
  return table;
}

}  // namespace waymark
