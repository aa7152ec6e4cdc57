#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/factors/corner_factor.hpp"
#include "waymark/factors/rolling_shutter.hpp"
#include "waymark/localization/landmarks.hpp"
#include "waymark/localization/riekf.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The sensor that sees the landmarks; of a robot with several cameras the first, and the others.
struct MountedSensor {
  std::optional<CameraModel> camera{};  ///< needed for corners only
  SE3 base_T_sensor{};                  ///< optical frame of a camera; x ahead, y left of a laser
  std::vector<MountedCamera> more_cameras{};

  /// The place among the others of the camera with this name; kFirst for any other name.
  [[nodiscard]] int camera_named(std::string_view name) const;
  /// Lens and mounting of a camera; the first one's lens must be known.
  [[nodiscard]] CameraView view(int camera) const;
  /// The mounting of a camera.
  [[nodiscard]] const SE3& base_T(int camera) const;
  static constexpr int kFirst = -1;
};

/// How a landmark was seen.
enum class ObservationKind : std::uint8_t {
  Corners,       ///< four corners in a picture, (13)
  PlanarPose,    ///< x, y, heading of the tag in base, (14)
  PlanarPoint,   ///< x, y in base, (15)
  RangeBearing,  ///< in the plane of the sensor, (16)
};

/// One known landmark as it was seen, ready to be compared with an estimate. A plain value of fixed size.
struct Observation {
  ObservationKind kind = ObservationKind::PlanarPoint;
  int landmark = 0;
  int camera = MountedSensor::kFirst;  ///< of MountedSensor: which one saw it
  double distance_m = 0;
  CornerFactor corners{};
  TagCorners measured_px{};  ///< as seen; `corners` has them as the middle row's time would show them
  Eigen::Vector3d planar = Eigen::Vector3d::Zero();  ///< what its kind says; unused numbers are 0
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();

  [[nodiscard]] int rows() const;
};

/// Nothing for what is not in the map, too far, or not usable (not finite, behind the camera, …).
[[nodiscard]] std::optional<Observation> observation_of(const TagDetection& detection,
                                                        const Landmarks& landmarks,
                                                        const MountedSensor& sensor,
                                                        const RiekfOptions& options,
                                                        int camera = MountedSensor::kFirst);
[[nodiscard]] std::optional<Observation> observation_of(const SeenTagPose& seen, const Landmarks& landmarks,
                                                        const MountedSensor& sensor,
                                                        const RiekfOptions& options,
                                                        int camera = MountedSensor::kFirst);
[[nodiscard]] std::optional<Observation> observation_of(const RangeBearing& seen, const Landmarks& landmarks,
                                                        const MountedSensor& sensor,
                                                        const RiekfOptions& options);

/// Brings the corners that a rolling shutter saw to the time of the middle row, for a robot at map_T_base
/// that moves with `velocity` (in base: x, y [m/s], yaw [rad/s]). May be called again with another estimate.
/// No allocation.
void bring_to_middle(Observation& observation, const Landmarks& landmarks, const MountedSensor& sensor,
                     const SE2& map_T_base, const Eigen::Vector3d& velocity, double readout_s);

/// Residual and derivatives at an estimate; nothing where the landmark could not be seen from there. No
/// allocation.
[[nodiscard]] std::optional<Linearised> linearise(const Observation& observation, const Landmarks& landmarks,
                                                  const MountedSensor& sensor, const SE2& map_T_base);

/// Where the landmark is on the floor, seen from base [m]; as measured, independent of the estimate.
[[nodiscard]] std::optional<Eigen::Vector2d> base_p_landmark(const Observation& observation,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& sensor);

/// Where base may be, from this observation alone, with the covariance of its left tangent in map: none, one,
/// or the two of a flat square (docs/concepts/pose.md). Only landmarks with a direction tell.
struct Guess {
  SE2 map_T_base{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};
struct Guesses {
  std::array<Guess, 2> all{};
  int count = 0;
};
[[nodiscard]] Guesses guesses_of(const Observation& observation, const Landmarks& landmarks,
                                 const MountedSensor& sensor, const RiekfOptions& options);
/// The same from two points seen at once; nothing when they are not as far apart as in the map.
[[nodiscard]] std::optional<Guess> guess_of_pair(const Observation& a, const Observation& b,
                                                 const Landmarks& landmarks, const MountedSensor& sensor,
                                                 const RiekfOptions& options);

}  // namespace waymark
