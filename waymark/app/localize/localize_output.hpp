#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/localize/localize_log.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Origin of the localised samples, for the output metadata.
struct LocalizeSource {
  std::string name{};
  std::string map{};                     ///< file or folder; only its name is written
  bool live = false;                     ///< record every sample, the robot file and the cameras
  std::string images{};                  ///< with `live`: how images are recorded (record_picture())
  std::string robot_yaml{};              ///< with `live`: content of the robot file; empty: none
  std::vector<MountedCamera> cameras{};  ///< with `live`
};

/// Fails on an unknown file extension, and on an existing file of poses.
[[nodiscard]] Status check_localize_output(const std::string& output);

/// Fails if images are to be recorded but no output is given. `images`: raw, jpeg; empty: none.
[[nodiscard]] Status check_recorded_images(const std::string& images, const std::string& output);

/// Collects, reports and writes the estimates of a localizer run.
class LocalizeOutput {
 public:
  /// Opens the output; an empty path means no output. Fails on an unknown extension, and on a file that
  /// already exists or cannot be written.
  [[nodiscard]] static Result<LocalizeOutput> open(const std::string& path, const LocalizerSetup& setup,
                                                   const LocalizeSource& source);

  Status on_sample(const Sample& sample);
  /// Skips an estimate whose stamp is not newer than that of the last one.
  Status on_estimate(const LocalizationEstimate& estimate);
  Status on_comparison(const NisRecord& record);
  /// Writes a certain pose in six degrees of freedom, which is not counted as an estimate.
  Status on_pose(SensorTime stamp, const ros2::PoseWithCovarianceStamped& pose);
  /// Closes the recording, or writes the poses unless the run failed. Returns the report without
  /// `lasting_nis`, `wall_s` and `problems`.
  [[nodiscard]] Result<LocalizeReport> close(bool failed);

 private:
  LocalizeOutput(std::string poses, LocalizeSource source)
      : poses_file_(std::move(poses)), source_(std::move(source)) {}

  std::string poses_file_;  ///< empty: none
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
