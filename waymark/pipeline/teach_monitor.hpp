#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct TeachMonitorOptions {
  double exposure_ms = 10;
  double focal_length_px = 440;
  double blur_px = 2;
  double acceleration_m_s2 = 2.5;
  double window_s = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.exposure_ms, Field{"exposure_ms", "Exposure time of the camera.", 0, 1000});
    visit(self.focal_length_px, Field{"focal_length_px", "Focal length of the camera, px.", 1, 1e6});
    visit(self.blur_px, Field{"blur_px", "Motion blur above which a warning is given, px.", 0, 1000});
    visit(self.acceleration_m_s2,
          Field{"acceleration_m_s2", "Acceleration above which a warning is given.", 0, 100});
    visit(self.window_s, Field{"window_s", "Time over which an acceleration is measured.", 0.01, 10});
  }
};

/// Looks over the shoulder of somebody who drives a teach lap: what is said while it can still be mended.
class TeachMonitor {
 public:
  explicit TeachMonitor(const TeachMonitorOptions& options) : options_(options) {}

  /// Samples in order; only odometry and frames of tags matter.
  void add(const Sample& sample);

  /// How far the picture of something far away goes while the shutter is open: yaw rate x exposure x focal
  /// length [px].
  [[nodiscard]] double motion_blur_px() const;
  /// Change of speed by odometry over the window.
  [[nodiscard]] double acceleration_m_s2() const;
  /// What is wrong at this moment, in a few words each; empty when all is well.
  [[nodiscard]] std::vector<std::string> live() const;
  /// What was wrong for so long that the lap suffers, in sentences that say what to do.
  [[nodiscard]] std::vector<std::string> summary() const;
  [[nodiscard]] double worst_blur_px() const { return worst_blur_px_; }
  [[nodiscard]] int blurred_frames() const { return blurred_frames_; }
  [[nodiscard]] int abrupt_moments() const { return abrupt_moments_; }

 private:
  struct Speed {
    SensorTime stamp{};
    double m_s = 0;
  };
  void follow(const Odometry& odometry);
  void count(const std::string& camera, std::size_t tags);

  TeachMonitorOptions options_;
  std::deque<Speed> speeds_{};
  double yaw_rate_rad_s_ = 0;
  std::map<std::string, std::size_t> tags_{};  ///< of the last frame of each camera
  bool abrupt_ = false;
  int frames_ = 0;
  int blurred_frames_ = 0;
  int abrupt_moments_ = 0;
  double worst_blur_px_ = 0;
};

}  // namespace waymark
