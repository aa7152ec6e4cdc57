#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/localize/localize_log.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Origin of the localised samples, which is written to the output metadata.
struct LocalizeSource {
  std::string name{};
  std::string map{};                     ///< file or folder, of which only the name is written
  bool live = false;                     ///< whether to record every sample, the robot file and the cameras
  std::string images{};                  ///< if `live`, how images are recorded (see record_image())
  std::string robot_yaml{};              ///< if `live`, the content of the robot file; empty if there is none
  std::vector<MountedCamera> cameras{};  ///< if `live`, the cameras to record
};

/// Fails if the file extension is unknown, or if a pose file already exists.
[[nodiscard]] Status check_localize_output(const std::string& output);

/// Fails if images are to be recorded but there is no output. `images` is "raw" or "jpeg", or empty if images
/// are not recorded.
[[nodiscard]] Status check_recorded_images(const std::string& images, const std::string& output);

/// Collects, reports and writes the estimates from a localizer run.
class LocalizeOutput {
 public:
  /// Opens the output. If the path is empty, nothing is written. Fails if the extension is unknown, or if the
  /// file already exists or cannot be written.
  [[nodiscard]] static Result<LocalizeOutput> open(const std::string& path, const LocalizerSetup& setup,
                                                   const LocalizeSource& source);

  Status on_sample(const Sample& sample);
  /// Skips the estimate if its timestamp is not newer than that of the last one.
  Status on_estimate(const LocalizationEstimate& estimate);
  Status on_comparison(const NisRecord& record);
  /// Writes a certain pose in six degrees of freedom. It is not counted as an estimate.
  Status on_pose(SensorTime stamp, const ros2::PoseWithCovarianceStamped& pose);
  /// Closes the recording or, unless the run failed, writes the pose file. The returned report lacks
  /// `lasting_nis`, `wall_s` and `problems`.
  [[nodiscard]] Result<LocalizeReport> close(bool failed);

 private:
  LocalizeOutput(std::string poses, LocalizeSource source)
      : poses_file_(std::move(poses)), source_(std::move(source)) {}

  std::string poses_file_;  ///< empty if there is none
  LocalizeSource source_;
  std::optional<SampleRecorder> recorder_{};
  std::optional<SensorTime> first_{};
  SensorTime newest_{};
  Trajectory trajectory_{};
  std::optional<SensorTime> last_{};
  LocalizeReport report_{};
  double nis_sum_ = 0;
};

}  // namespace waymark
