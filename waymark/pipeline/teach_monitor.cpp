#include "waymark/pipeline/teach_monitor.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr double kTooManyBlurred = 0.05;

}  // namespace

void TeachMonitor::add(const Sample& sample) {
  if (const auto* odometry = std::get_if<Odometry>(&sample)) follow(*odometry);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) count(frame->camera, frame->detections.size());
  if (const auto* frame = std::get_if<TagPoseFrame>(&sample)) count(frame->camera, frame->tags.size());
}

void TeachMonitor::count(const std::string& camera, std::size_t tags) {
  tags_[camera] = tags;
  ++frames_;
  const double blur = motion_blur_px();
  blurred_frames_ += blur > options_.blur_px ? 1 : 0;
  worst_blur_px_ = std::max(worst_blur_px_, blur);
}

void TeachMonitor::follow(const Odometry& odometry) {
  yaw_rate_rad_s_ = odometry.yaw_rate_rad_s;
  // A clock that jumped back begins again.
  if (!speeds_.empty() && odometry.stamp <= speeds_.back().stamp) speeds_.clear();
  speeds_.push_back({odometry.stamp, odometry.speed_m_s});
  while (to_seconds(speeds_.back().stamp - speeds_.front().stamp) > options_.window_s) speeds_.pop_front();
  const bool abrupt = std::abs(acceleration_m_s2()) > options_.acceleration_m_s2;
  abrupt_moments_ += abrupt && !abrupt_ ? 1 : 0;
  abrupt_ = abrupt;
}

double TeachMonitor::motion_blur_px() const {
  return std::abs(yaw_rate_rad_s_) * options_.exposure_ms * 1e-3 * options_.focal_length_px;
}

double TeachMonitor::acceleration_m_s2() const {
  if (speeds_.size() < 2) return 0;
  const double dt_s = to_seconds(speeds_.back().stamp - speeds_.front().stamp);
  return dt_s < options_.window_s / 2 ? 0 : (speeds_.back().m_s - speeds_.front().m_s) / dt_s;
}

std::vector<std::string> TeachMonitor::live() const {
  std::vector<std::string> words;
  if (motion_blur_px() > options_.blur_px)
    words.push_back(fmt::format("motion blur {:.1f} px: turn more slowly", motion_blur_px()));
  if (abrupt_) words.push_back(fmt::format("abrupt: {:+.1f} m/s2", acceleration_m_s2()));
  std::size_t tags = tags_.empty() ? 2 : 0;
  for (const auto& [camera, in_view] : tags_) tags += in_view;
  if (tags < 2) words.emplace_back(tags == 1 ? "one tag only" : "no tag");
  return words;
}

std::vector<std::string> TeachMonitor::summary() const {
  std::vector<std::string> words;
  if (frames_ > 0 && blurred_frames_ > kTooManyBlurred * frames_)
    words.push_back(
        fmt::format("{:.0f} % of the frames smear by more than {:g} px (up to {:.1f}): turn more slowly, or "
                    "give the camera more light and a shorter exposure",
                    100.0 * blurred_frames_ / frames_, options_.blur_px, worst_blur_px_));
  if (abrupt_moments_ > 0)
    words.push_back(fmt::format(
        "the speed changed abruptly {} times (more than {:g} m/s2): wheels slip then, start and stop gently",
        abrupt_moments_, options_.acceleration_m_s2));
  return words;
}

}  // namespace waymark
