#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/odometry_frames.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Converts ROS 2 messages of any file format to samples.
class SampleDecoder {
 public:
  using Visitor = std::function<Status(const Sample&)>;
  explicit SampleDecoder(Visitor visit);
  ~SampleDecoder();
  SampleDecoder(const SampleDecoder&) = delete;
  SampleDecoder& operator=(const SampleDecoder&) = delete;

  /// Also converts transforms to odometry (TransformOdometry); for recordings without nav_msgs/Odometry.
  void use_transforms(std::optional<OdometryFrames> link);
  /// Visits the sample of a message in plain CDR, if its type and topic are supported. log_time [ns] is the
  /// stamp for types without a header. Fails if a message cannot be decoded or the visitor fails. A tag frame
  /// waits for the covariances that may follow it.
  Status add(std::string_view topic, std::string_view type, std::uint64_t log_time, ByteSpan cdr);
  /// Visits the tag frame that is still waiting, if any.
  Status finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The camera of an MCAP file, its mounting on the robot, and the metadata.
[[nodiscard]] Result<RecordingSetup> read_setup(const ByteSource& source);

/// Calls visit for every sample on supported topics, in order of log time. Fails if a message cannot be
/// decoded.
[[nodiscard]] Status visit_samples(const ByteSource& source,
                                   const std::function<Status(const Sample&)>& visit);

}  // namespace waymark
