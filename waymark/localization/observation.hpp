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

/// The sensor that observes landmarks: the first camera or a laser, plus any other cameras.
struct MountedSensor {
  std::optional<CameraModel> camera{};  ///< only required for corners
  SE3 base_T_sensor{};  ///< for a camera, the optical frame; for a laser, x points ahead and y to the left
  std::vector<MountedCamera> more_cameras{};

  /// Index in more_cameras of the camera with this name; kFirst for any other name.
  [[nodiscard]] int camera_named(std::string_view name) const;
  /// Lens and mounting of a camera. The lens of the first camera must be set.
  [[nodiscard]] CameraView view(int camera) const;
  /// The mounting of a camera.
  [[nodiscard]] const SE3& base_T(int camera) const;
  static constexpr int kFirst = -1;
};

/// Type of an observation.
enum class ObservationKind : std::uint8_t {
  Corners,       ///< four corners in an image, (13)
  PlanarPose,    ///< x, y and heading of the tag in base, (14)
  PlanarPoint,   ///< x and y in base, (15)
  RangeBearing,  ///< in the plane of the sensor, (16)
};

/// One observation of a map landmark, ready to be compared with an estimate. A plain value of fixed size.
struct Observation {
  ObservationKind kind = ObservationKind::PlanarPoint;
  int landmark = 0;
  int camera = MountedSensor::kFirst;  ///< index of the camera in MountedSensor
  double distance_m = 0;
  CornerFactor corners{};
  TagCorners measured_px{};  ///< as measured; `corners` holds them at the time of the middle row
  Eigen::Vector3d planar = Eigen::Vector3d::Zero();  ///< values as defined by its kind; unused ones are 0
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();

  [[nodiscard]] int rows() const;
};

/// Empty if the landmark is not in the map, too far away, or unusable (not finite, behind the camera, …).
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

/// Corrects corners captured with a rolling shutter to the time of the middle row, for a robot at map_T_base
/// moving with `velocity` (in base: x, y [m/s], yaw [rad/s]). May be called again with a different estimate.
/// Does not allocate.
void bring_to_middle(Observation& observation, const Landmarks& landmarks, const MountedSensor& sensor,
                     const SE2& map_T_base, const Eigen::Vector3d& velocity, double readout_s);

/// Residual and derivatives at an estimate; empty if the landmark is not visible from there. Does not
/// allocate.
[[nodiscard]] std::optional<Linearised> linearise(const Observation& observation, const Landmarks& landmarks,
                                                  const MountedSensor& sensor, const SE2& map_T_base);

/// Position of the landmark on the floor, in base [m], as measured and independent of the estimate.
[[nodiscard]] std::optional<Eigen::Vector2d> base_p_landmark(const Observation& observation,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& sensor);

/// A possible pose of the base from a single observation, with the covariance of its left tangent in map. An
/// observation results in up to two guesses, because a planar square has two poses (docs/concepts/pose.md).
/// Landmarks without orientation result in none.
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
/// A guess from two points observed at the same time; empty if their distance differs from that in the map.
[[nodiscard]] std::optional<Guess> guess_of_pair(const Observation& a, const Observation& b,
                                                 const Landmarks& landmarks, const MountedSensor& sensor,
                                                 const RiekfOptions& options);

}  // namespace waymark
