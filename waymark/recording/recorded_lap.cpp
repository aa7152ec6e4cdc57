#include "waymark/recording/recorded_lap.hpp"

#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

/// The topics that hold pictures, or the others.
LogSelection topics_of(const MessageLog& log, bool pictures) {
  LogSelection selection;
  for (const LogChannel& channel : log.channels()) {
    const bool picture = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
    if (picture == pictures) selection.topics.insert(channel.topic);
  }
  return selection;
}

void keep(const Sample& sample, RecordedLap& lap) {
  if (const auto* frame = std::get_if<TagFrame>(&sample)) lap.frames.push_back(*frame);
  if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.odometry.push_back(*odometry);
  if (const auto* poses = std::get_if<TagPoseFrame>(&sample)) lap.tag_poses.push_back(*poses);
  if (const auto* imu = std::get_if<ImuSample>(&sample)) lap.imu.push_back(*imu);
  if (const auto* truth = std::get_if<TruthPose>(&sample))
    lap.truth.push_back({truth->stamp, truth->map_T_base});
}

Status find_tags(MessageLog& log, const FrameFinder& find, RecordedLap& lap) {
  const LogSelection pictures = topics_of(log, true);
  if (pictures.topics.empty()) return {};
  const CameraModel* camera = lap.setup.camera ? &*lap.setup.camera : nullptr;
  return log.visit_samples(pictures, [&](const Sample& sample) -> Status {
    const auto* picture = std::get_if<CameraFrame>(&sample);
    if (picture == nullptr) return {};
    Result<TagFrame> frame = find(*picture, camera);
    if (!frame) return tl::unexpected(frame.error());
    lap.frames.push_back(std::move(*frame));
    return {};
  });
}

}  // namespace

Result<RecordedLap> read_lap(MessageLog& log, const FrameFinder& find, TagSource source) {
  Result<RecordingSetup> setup = log.setup();
  if (!setup) return tl::unexpected(setup.error());
  RecordedLap lap{.setup = std::move(*setup)};
  std::vector<Error> damaged;
  const Status read = log.visit_attachments([&](const MessageLog::Attachment& attachment) {
    lap.attachments[attachment.name] = std::string(as_text(attachment.data));
    return Status{};
  });
  if (!read) damaged.push_back(read.error());
  const LogSelection others = topics_of(log, false);
  Status status;
  if (!others.topics.empty()) {
    status = log.visit_samples(others, [&](const Sample& sample) {
      keep(sample, lap);
      return Status{};
    });
  }
  if (source == TagSource::Pictures) {
    if (topics_of(log, true).topics.empty())
      return fail(ErrorCode::NotFound, "the recording holds no pictures to look for tags in", {},
                  "Leave out the detector's settings to take the tags it holds.");
    lap.frames.clear();
  }
  if (status && lap.frames.empty() && lap.tag_poses.empty() && find) status = find_tags(log, find, lap);
  if (!status) return tl::unexpected(status.error());
  lap.setup.problems = std::move(damaged);
  for (const LogProblem& problem : log.problems()) lap.setup.problems.push_back(problem.error);
  return lap;
}

}  // namespace waymark
