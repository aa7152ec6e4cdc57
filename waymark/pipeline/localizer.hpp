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
  Ekf,       ///< the same with coordinate errors
  Anchor,    ///< nearest tag and odometry
  Smoother,  ///< the right-invariant filter with a backward pass
};

struct LocalizerSetup {
  Landmarks landmarks{};
  TagMap
      tags{};  ///< the same map with tag poses; empty if it has none (the method anchor is then unavailable)
  MountedSensor sensor{};
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  AnchorOptions anchor{};
  /// The estimate is used to drive a robot: the latency is estimated during the run
  /// (RiekfLocalizer::estimate_camera_latency()), and the replay detects motion by hand during a standstill
  /// (Tracker::trust_standstill()).
  bool live = false;
};

/// Names that parse_localization_method() accepts: riekf, ekf, anchor, smoother.
[[nodiscard]] std::vector<std::string> localization_methods();
[[nodiscard]] std::string_view to_string(LocalizationKind method);
/// Fails (InvalidArgument, with a suggestion) on an unknown name.
[[nodiscard]] Result<LocalizationKind> parse_localization_method(std::string_view name);

/// Fails on an empty map, on overlapping tags, and if map or sensors lack data that the method needs.
[[nodiscard]] Result<std::unique_ptr<LocalizationMethod>> make_localization_method(
    const LocalizerSetup& setup);

/// The localisation phase: takes samples in order, from a robot or a log, and provides an estimate at any
/// time.
class Localizer {
 public:
  static Result<Localizer> make(const LocalizerSetup& setup);

  /// Commands, scans, images and ground truth are ignored.
  void add(const Sample& sample);
  /// The newest estimate; none before the first fix. `certain`: whether it is reliable. With the fixed-lag
  /// smoother the estimate is one lag old.
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const { return method_->estimate(); }
  /// The smoothed run if the method is smoother (with a lag: only the end, which estimate() has not returned
  /// yet); otherwise empty.
  [[nodiscard]] std::vector<LocalizationEstimate> smoothed() const;
  /// The filter of the method; nullptr if it has none.
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
