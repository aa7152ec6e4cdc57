#include "waymark/recording/recorded_lap.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark {
namespace {

void keep(const Sample& sample, RecordedLap& lap) {
  if (const auto* frame = std::get_if<TagFrame>(&sample)) lap.frames.push_back(*frame);
  if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.odometry.push_back(*odometry);
  if (const auto* poses = std::get_if<TagPoseFrame>(&sample)) lap.tag_poses.push_back(*poses);
  if (const auto* imu = std::get_if<ImuSample>(&sample)) lap.imu.push_back(*imu);
  if (const auto* truth = std::get_if<TruthPose>(&sample))
    lap.truth.push_back({truth->stamp, truth->map_T_base});
}

template <class Frame>
void put_in_order(std::vector<Frame>& frames, std::vector<std::string>& notes) {
  constexpr Duration kJump = std::chrono::seconds(1);
  std::size_t out_of_order = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const Duration behind = frames[i - 1].stamp - frames[i].stamp;
    if (behind > kJump) return;
    if (behind > Duration(0)) ++out_of_order;
  }
  if (out_of_order > 0) {
    std::ranges::stable_sort(frames, {}, &Frame::stamp);
    notes.push_back(
        fmt::format("images recorded out of order, sorted by stamp: {}", counted(out_of_order, "image")));
  }
  std::map<std::string, SensorTime> newest;
  const std::size_t again = std::erase_if(frames, [&](const Frame& frame) {
    const auto [entry, is_first] = newest.try_emplace(frame.camera, frame.stamp);
    return !is_first && std::exchange(entry->second, frame.stamp) == frame.stamp;
  });
  if (again > 0)
    notes.push_back(fmt::format("images with the stamp of another image of the same camera, skipped: {}",
                                counted(again, "image")));
}

Status find_tags(MessageLog& log, const FrameFinder& find, RecordedLap& lap) {
  const LogSelection images = log.topics_used(lap.setup, true);
  if (images.topics.empty()) return {};
  return log.visit_samples(images, [&](const Sample& sample) -> Status {
    const auto* image = std::get_if<CameraFrame>(&sample);
    if (image == nullptr) return {};
    Result<TagFrame> frame = find(*image, lens_of(lap.setup, image->camera));
    if (!frame) return tl::unexpected(frame.error());
    lap.frames.push_back(std::move(*frame));
    return {};
  });
}

}  // namespace

void order_frames(RecordedLap& lap) {
  put_in_order(lap.frames, lap.notes);
  put_in_order(lap.tag_poses, lap.notes);
}

void remove_other_clocks(RecordedLap& lap) {
  ClockCheck clocks;
  const auto add = [&](StampedKind kind, const auto& samples) {
    for (const auto& sample : samples) clocks.add(kind, sample.stamp);
  };
  add(StampedKind::Observations, lap.frames);
  add(StampedKind::Observations, lap.tag_poses);
  add(StampedKind::Odometry, lap.odometry);
  add(StampedKind::Imu, lap.imu);
  add(StampedKind::Truth, lap.truth);
  if (!clocks.overlaps(StampedKind::Odometry)) lap.odometry.clear();
  if (!clocks.overlaps(StampedKind::Imu)) lap.imu.clear();
  if (!clocks.overlaps(StampedKind::Truth)) lap.truth.clear();
  lap.other_clock = clocks.mismatch();
}

void name_family(RecordedLap& lap) {
  const auto for_ids = [&](const auto& visit) {
    for (TagFrame& frame : lap.frames) {
      for (TagDetection& detection : frame.detections) visit(detection.tag);
    }
    for (TagPoseFrame& frame : lap.tag_poses) {
      for (auto& seen : frame.tags) visit(seen.tag);
    }
  };
  int largest = -1;
  for_ids([&](const TagId& id) {
    if (id.family == FamilyId::Tag36h11) largest = std::max(largest, id.number);
  });
  const FamilyId family = usual_family(largest);
  if (family == FamilyId::Tag36h11) return;
  for_ids([&](TagId& id) {
    if (id.family == FamilyId::Tag36h11) id.family = family;
  });
  lap.notes.push_back(fmt::format("no tag {} in tag36h11; all tags of this family are assumed to be {}",
                                  largest, to_string(family)));
}

void rejoin_odometry(RecordedLap& lap) {
  SE2 odom_T_later;  // maps the odometry frame after the last jump into the initial one
  int jumps = 0;
  for (std::size_t i = 1; i < lap.odometry.size(); ++i) {
    Odometry rejoined = lap.odometry[i];
    rejoined.odom_T_base = odom_T_later * rejoined.odom_T_base;
    const Odometry& before = lap.odometry[i - 1];
    if (odometry_jumped({.stamp = before.stamp,
                         .odom_T_base = odom_T_later.inverse() * before.odom_T_base,
                         .speed_m_s = before.speed_m_s},
                        lap.odometry[i])) {
      ++jumps;
      odom_T_later = before.odom_T_base * lap.odometry[i].odom_T_base.inverse();
      rejoined.odom_T_base = before.odom_T_base;
    }
    lap.odometry[i] = rejoined;
  }
  if (jumps > 0)
    lap.notes.push_back(
        fmt::format("odometry jumped {}, as after a restart of the robot or a reset of its odometry; the "
                    "robot is assumed to have been stationary meanwhile. If tags contradict this, drive the "
                    "lap again",
                    counted(jumps, "time")));
}

Result<RecordedLap> read_lap(MessageLog& log, const FrameFinder& find, TagSource source,
                             const CameraChoice& choice) {
  Result<RecordingSetup> setup = log.setup(choice);
  if (!setup) return tl::unexpected(setup.error());
  if (setup->chosen.ambiguous) return tl::unexpected(*setup->chosen.ambiguous);
  RecordedLap lap{.setup = std::move(*setup)};
  std::vector<Error> damaged;
  const Status read = log.visit_attachments([&](const MessageLog::Attachment& attachment) {
    lap.attachments[attachment.name] = std::string(as_text(attachment.data));
    return Status{};
  });
  if (!read) damaged.push_back(read.error());
  const LogSelection others = log.topics_used(lap.setup, false);
  Status status;
  if (!others.topics.empty()) {
    status = log.visit_samples(others, [&](Sample sample) {
      turn_into_base(sample, lap.setup.chosen);
      keep(sample, lap);
      return Status{};
    });
  }
  if (source == TagSource::Images) {
    if (const auto depth = only_depth_images(lap.setup.facts)) return tl::unexpected(*depth);
    if (log.topics_used(lap.setup, true).topics.empty())
      return fail(ErrorCode::NotFound, "the recording has no images in which to detect tags", {},
                  "Omit the detector settings to use the recorded tags.");
    lap.frames.clear();
  }
  if (status && lap.frames.empty() && lap.tag_poses.empty() && find) status = find_tags(log, find, lap);
  if (!status) return tl::unexpected(status.error());
  if (lap.frames.empty() && lap.tag_poses.empty() && find)
    if (const auto depth = only_depth_images(lap.setup.facts)) lap.notes.push_back(to_string(*depth));
  name_family(lap);
  order_frames(lap);
  remove_other_clocks(lap);
  rejoin_odometry(lap);
  lap.setup.problems = std::move(damaged);
  for (const LogProblem& problem : log.problems()) lap.setup.problems.push_back(problem.error);
  if (lap.other_clock) lap.setup.problems.push_back(lap.other_clock->error);
  return lap;
}

}  // namespace waymark
