#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/localization/anchor_localizer.hpp"
#include "waymark/localization/smoother.hpp"

namespace waymark {

enum class LocalizationKind : std::uint8_t {
  Riekf,     ///< right-invariant extended Kalman filter
  Ekf,       ///< the same filter with errors expressed in coordinates
  Anchor,    ///< nearest tag plus odometry
  Smoother,  ///< the right-invariant filter with a backward pass
};

struct LocalizerSetup {
  Landmarks landmarks{};
  TagMap tags{};  ///< the same map with tag poses; empty if they are unknown, in which case the anchor method
                  ///< is unavailable
  MountedSensor sensor{};
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  AnchorOptions anchor{};
  /// Whether the estimate is used to drive a robot. If so, the latency is estimated during the run
  /// (RiekfLocalizer::estimate_camera_latency()), and the replay detects whether the robot is moved by hand
  /// at standstill (Tracker::trust_standstill()).
  bool live = false;
};

/// The names that parse_localization_method() accepts: riekf, ekf, anchor, smoother.
[[nodiscard]] std::vector<std::string> localization_methods();
[[nodiscard]] std::string_view to_string(LocalizationKind method);
/// Fails (InvalidArgument, with a suggestion) if the name is unknown.
[[nodiscard]] Result<LocalizationKind> parse_localization_method(std::string_view name);

/// Fails if the map is empty, if tags overlap, or if the map or the sensors lack data that the method needs.
[[nodiscard]] Result<std::unique_ptr<LocalizationMethod>> make_localization_method(
    const LocalizerSetup& setup);

/// The localisation phase. Accepts samples in order, from a robot or a recording, and provides an estimate at
/// any time.
class Localizer {
 public:
  static Result<Localizer> make(const LocalizerSetup& setup);

  /// Commands, scans, images and ground truth are ignored.
  void add(const Sample& sample);
  /// The newest estimate; `nullopt` before the first fix. `certain` is true if it is reliable. With the
  /// fixed-lag smoother, the estimate is one lag behind.
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const { return method_->estimate(); }
  /// The smoothed run if the method is the smoother; otherwise empty. With a lag, it contains only the end
  /// that estimate() has not returned yet.
  [[nodiscard]] std::vector<LocalizationEstimate> smoothed() const;
  /// The filter used by the method; nullptr if there is none.
  [[nodiscard]] RiekfLocalizer* filter() { return method_->filter(); }

  [[nodiscard]] LocalizationMethod& method() { return *method_; }
  [[nodiscard]] const LocalizationMethod& method() const { return *method_; }

 private:
  Localizer(std::unique_ptr<LocalizationMethod> method, bool smooths)
      : method_(std::move(method)), smooths_(smooths) {}
  std::unique_ptr<LocalizationMethod> method_;
  bool smooths_;
};

}  // namespace waymark
