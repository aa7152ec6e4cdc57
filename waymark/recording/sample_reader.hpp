#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/camera_choice.hpp"
#include "waymark/recording/mcap_reader.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// What a recording says about the robot before any sample.
struct RecordingSetup {
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  std::vector<MountedCamera> more_cameras{};  ///< beside that one, where all cameras are used
  std::map<std::string, std::map<std::string, std::string>> metadata{};  ///< by name
  std::vector<Error> problems{};  ///< damage in the file; what could be read is read
  CameraFacts facts{};            ///< all that a recording of ROS says of cameras and frames
  ChosenCamera chosen{};          ///< which of it `camera` and `base_T_cam` are
};

/// The lens of the camera that a sample names; nullptr: not known.
[[nodiscard]] const CameraModel* lens_of(const RecordingSetup& setup, std::string_view camera);

/// Chooses the camera among the facts; of several that are all known, all of them.
void choose(RecordingSetup& setup, const CameraChoice& choice = {});

/// Turns what an IMU says into the axes of the base, where the recording says how they lie.
void turn_into_base(Sample& sample, const ChosenCamera& chosen);

/// The camera, its place on the robot, and the metadata.
[[nodiscard]] Result<RecordingSetup> read_setup(const ByteSource& source);

/// Turns ROS 2 messages into samples, one after another, whatever file they come from.
class SampleDecoder {
 public:
  using Visitor = std::function<Status(const Sample&)>;
  explicit SampleDecoder(Visitor visit);
  ~SampleDecoder();
  SampleDecoder(const SampleDecoder&) = delete;
  SampleDecoder& operator=(const SampleDecoder&) = delete;

  /// Visits the sample of a message in plain CDR (log_time [ns]: the stamp of types without a header), if its
  /// type and topic are ones we know. Fails when it does not decode, or the visitor fails. A frame of tags
  /// waits for the covariances that may follow it.
  Status add(std::string_view topic, std::string_view type, std::uint64_t log_time, ByteSpan cdr);
  /// Visits what still waits.
  Status finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Calls visit for every sample of the topics we know, in order of log time. Fails on a message that does not
/// decode.
[[nodiscard]] Status visit_samples(const ByteSource& source,
                                   const std::function<Status(const Sample&)>& visit);

}  // namespace waymark
