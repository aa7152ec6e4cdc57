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
  Ekf,       ///< the same with its error in coordinates
  Anchor,    ///< nearest tag and odometry
  Smoother,  ///< the right-invariant filter with a backward pass
};

struct LocalizerSetup {
  Landmarks landmarks{};
  TagMap tags{};  ///< the same as tags with poses; empty when the map has none (then no method anchor)
  MountedSensor sensor{};
  LocalizationKind method = LocalizationKind::Riekf;
  RiekfOptions filter{};
  AnchorOptions anchor{};
  /// A robot drives by it: the latency is estimated meanwhile (RiekfLocalizer::estimate_camera_latency()),
  /// and who moved a robot that stands is for the replay to judge (Tracker::trust_standstill()).
  bool live = false;
};

/// The names of the methods, as parse_localization_method() takes them: riekf, ekf, anchor, smoother.
[[nodiscard]] std::vector<std::string> localization_methods();
[[nodiscard]] std::string_view to_string(LocalizationKind method);
/// Fails (InvalidArgument, with a suggestion) on a name that is none of them.
[[nodiscard]] Result<LocalizationKind> parse_localization_method(std::string_view name);

/// Fails on an empty map, on tags that hang in one another, and when the method needs
/// what the map or the sensor does not have.
[[nodiscard]] Result<std::unique_ptr<LocalizationMethod>> make_localization_method(
    const LocalizerSetup& setup);

/// The localise phase: samples in, as they come, from a robot or a log; where the robot is comes out at any
/// time.
class Localizer {
 public:
  static Result<Localizer> make(const LocalizerSetup& setup);

  /// Commands, scans, pictures and the truth are passed over.
  void add(const Sample& sample);
  /// The newest estimate; nothing before the first guess. `certain` says whether to rely on it. Of a smoother
  /// with a lag: of a lag ago.
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const { return method_->estimate(); }
  /// The run in hindsight, when the method is smoother (with a lag: the end of it, which estimate() has not
  /// said); else empty.
  [[nodiscard]] std::vector<LocalizationEstimate> smoothed() const;
  /// The filter inside, where there is one.
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
