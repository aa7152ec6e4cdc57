#include "waymark/localization/riekf_localizer.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/localization/tag_fix.hpp"

namespace waymark {
namespace {

constexpr Duration kWindow = std::chrono::seconds(1);
constexpr Duration kBetweenSnapshots = std::chrono::milliseconds(100);
/// Longer than this nobody waits for odometry before a look is used.
constexpr double kLastingTooLarge = 4;
constexpr Duration kPatience = std::chrono::milliseconds(250);

}  // namespace

RiekfLocalizer::RiekfLocalizer(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options,
                               ErrorState error)
    : input_(options),
      timeline_(1024, 128),
      tracker_(std::move(landmarks), std::move(sensor), options, error),
      snapshots_(kSnapshots, tracker_.state()),
      camera_latency_(std::llround(options.camera_latency_s * 1e9)),
      given_camera_latency_(camera_latency_) {}

void RiekfLocalizer::start_from(const SE2& map_T_base, double sigma_m, double sigma_rad) {
  tracker_.start_from(map_T_base, sigma_m, sigma_rad);
}

/// What comes late from before is of another estimate: nobody goes back behind this moment.
bool RiekfLocalizer::restart_from(const GivenPose& given) {
  tracker_.restart_from(given);
  snapshot_first_ = 0;
  snapshot_count_ = 0;
  if (tracker_.state().started) snapshot();
  return true;
}

void RiekfLocalizer::snapshot() {
  const SensorTime now = tracker_.state().stamp;
  if (snapshot_count_ > 0 && now - snapshot_at(snapshot_count_ - 1).stamp < kBetweenSnapshots) return;
  if (snapshot_count_ == kSnapshots) {
    snapshot_first_ = (snapshot_first_ + 1) % kSnapshots;
    --snapshot_count_;
  }
  tracker_.save(snapshot_at(snapshot_count_++));
}

/// Back to a moment before; false when that is too long ago.
bool RiekfLocalizer::rewind(SensorTime before) {
  while (snapshot_count_ > 0 && snapshot_at(snapshot_count_ - 1).stamp >= before) --snapshot_count_;
  if (snapshot_count_ == 0) return false;
  tracker_.restore(snapshot_at(snapshot_count_ - 1));
  ++rewinds_;
  return true;
}

/// Where a look of this time belongs; nullptr when it comes too late.
FrameObservations* RiekfLocalizer::place(SensorTime stamp) {
  const TrackState& now = tracker_.state();
  if (!now.started) {
    if (timeline_.empty() && moved_) return nullptr;  // before the first motion is known
    tracker_.start_at(stamp);
  }
  if (stamp < now.stamp) {
    const bool reachable = snapshot_count_ > 0 && snapshot_at(0).stamp < stamp;
    if (!reachable) {
      if (now.stamp - stamp > kWindow) ++too_late_;  // else it is from before anything was known
      return nullptr;
    }
    rewind(stamp);
  }
  return &timeline_.add_frame(stamp);
}

void RiekfLocalizer::advance_to(SensorTime stamp) {
  for (std::size_t i = 0; i < timeline_.segments(); ++i) {
    const MotionSegment& segment = timeline_.segment(i);
    const SensorTime begin = std::max(segment.from, tracker_.state().stamp);
    const SensorTime end = std::min(segment.to, stamp);
    if (end <= begin) continue;
    tracker_.advance(segment.part(begin, end), end);
  }
}

/// Up to where motion is known, looks in their order.
void RiekfLocalizer::run() {
  const SensorTime covered = std::max(timeline_.covered(), tracker_.state().stamp);
  for (std::size_t i = 0; i < timeline_.frames(); ++i) {
    FrameObservations& frame = timeline_.frame(i);
    const TrackState& now = tracker_.state();
    const bool done = frame.stamp < now.frame_stamp ||
                      (frame.stamp == now.frame_stamp && frame.number <= now.frame_number) ||
                      frame.stamp < now.stamp;
    if (done || frame.stamp > covered || !frame.sealed) continue;
    advance_to(frame.stamp);
    tracker_.process(frame);
    snapshot();
  }
  advance_to(open_ == nullptr ? covered : std::min(covered, open_->stamp));
  snapshot();
  timeline_.forget_before(tracker_.state().stamp - kWindow - kBetweenSnapshots * 3);
}

/// A look that waited in vain for odometry gets a guess.
void RiekfLocalizer::cover(SensorTime stamp) {
  const SensorTime covered = std::max(timeline_.covered(), tracker_.state().stamp);
  if (stamp <= covered || (moved_ && stamp - covered < kPatience)) return;
  timeline_.add(input_.guess(covered, stamp));
}

/// One Gauss-Newton step each time that the innovations are sure of it; they are then collected anew.
void RiekfLocalizer::correct_camera_latency() {
  constexpr Eigen::Index kCameraLatencyIndex = 7;
  constexpr Duration kFarthest = std::chrono::milliseconds(300);
  const auto& suspect = tracker_.suspect();
  if (!estimates_camera_latency_ || !suspect || suspect->suspect != Suspect::CameraLatency ||
      !tracker_.sees_corners())
    return;
  const Duration found =
      camera_latency_ + Duration(std::llround(suspect->fit.value[kCameraLatencyIndex] * 1e9));
  if (found - given_camera_latency_ > kFarthest || given_camera_latency_ - found > kFarthest) return;
  camera_latency_ = found;
  tracker_.forget_systematic();
}

void RiekfLocalizer::add(const TagFrame& frame) {
  ++frames_;
  correct_camera_latency();
  const SensorTime stamp = frame.stamp - camera_latency_;
  FrameObservations* slot = place(stamp);
  if (slot == nullptr) return;
  const int camera = tracker_.mounted_sensor().camera_named(frame.camera);
  for (const TagDetection& detection : frame.detections) {
    ++observations_;
    const auto observation = observation_of(detection, tracker_.landmarks(), tracker_.mounted_sensor(),
                                            tracker_.options(), camera);
    const bool known = tracker_.landmarks().find(detection.tag) >= 0;
    mapped_ += known ? 1 : 0;
    other_family_ += !known && tracker_.landmarks().find(std::int64_t{detection.tag.number}) >= 0 ? 1 : 0;
    if (!observation) continue;
    if (slot->count < FrameObservations::kMaxObservations)
      slot->seen[slot->count++] = *observation;
    else
      ++crowded_;
  }
  newest_ = *slot;
  cover(stamp);
  run();
}

std::optional<TagFix> RiekfLocalizer::tag_fix() const {
  const auto known = tracker_.estimate();
  if (!known || newest_.count == 0) return std::nullopt;
  auto fix = fix_of({newest_.seen.data(), newest_.count}, tracker_.landmarks(), tracker_.watch(),
                    tracker_.mounted_sensor(), tracker_.options(), known->map_T_base);
  if (fix) fix->stamp = newest_.stamp;
  return fix;
}

void RiekfLocalizer::add(const TagPoseFrame& frame) {
  ++frames_;
  const SensorTime stamp = frame.stamp - camera_latency_;
  FrameObservations* slot = place(stamp);
  if (slot == nullptr) return;
  const int camera = tracker_.mounted_sensor().camera_named(frame.camera);
  for (const SeenTagPose& seen : frame.tags) {
    ++observations_;
    const auto observation =
        observation_of(seen, tracker_.landmarks(), tracker_.mounted_sensor(), tracker_.options(), camera);
    mapped_ += tracker_.landmarks().find(seen.tag) >= 0 ? 1 : 0;
    if (observation && slot->count < FrameObservations::kMaxObservations)
      slot->seen[slot->count++] = *observation;
  }
  cover(stamp);
  run();
}

void RiekfLocalizer::add(const RangeBearing& seen) {
  ++observations_;
  const SensorTime stamp = seen.stamp - camera_latency_;
  const auto observation =
      observation_of(seen, tracker_.landmarks(), tracker_.mounted_sensor(), tracker_.options());
  mapped_ += tracker_.landmarks().find(seen.landmark) >= 0 ? 1 : 0;
  if (open_ == nullptr || open_->stamp != stamp) {
    if (open_ != nullptr) {
      open_->sealed = true;
      open_ = nullptr;
      run();
    }
    ++frames_;
    open_ = place(stamp);
    if (open_ == nullptr) return;
    open_->sealed = false;
  }
  if (observation && open_->count < FrameObservations::kMaxObservations)
    open_->seen[open_->count++] = *observation;
}

void RiekfLocalizer::add(const Odometry& odometry) {
  moved_ = true;
  std::optional<MotionSegment> segment = input_.add(odometry);
  if (!segment) return;
  const SensorTime covered = std::max(timeline_.covered(), tracker_.state().stamp);
  if (!tracker_.state().started) {
    tracker_.start_at(segment->from);
  } else if (segment->from < covered && covered < segment->to) {  // part of it was guessed
    segment->step = segment->part(covered, segment->to);
    segment->step.share = 1;  // what was guessed of it was wrong by numbers of its own
    segment->step.continues = false;
    segment->from = covered;
  } else if (segment->to <= covered) {
    return;
  } else if (segment->from > covered) {
    timeline_.add(input_.guess(covered, segment->from));
  }
  timeline_.add(*segment);
  if (open_ != nullptr && open_->stamp < segment->to) {
    open_->sealed = true;
    open_ = nullptr;
    cover(odometry.stamp);
  }
  run();
}

std::vector<std::string> RiekfLocalizer::problems() const {
  std::vector<std::string> all = tracker_.watch().findings();
  const auto say = [&](int count, const char* thing, const char* words) {
    if (count > 0) all.push_back(fmt::format(fmt::runtime(words), counted(count, thing)));
  };
  if (frames_ > 0 && observations_ == 0) all.emplace_back("no tag was seen in any picture");
  if (observations_ > 0 && mapped_ == 0)
    all.push_back(other_family_ > 0
                      ? "the tags that were seen are of another family than those of the map"
                      : "none of the tags that were seen is in the map: is it the map of this place?");
  if (tracker_.state().starts == 0 && mapped_ > 0)
    all.emplace_back(
        "never two tags of the map in view that agreed about where the robot is: were there two? Do their "
        "sizes, "
        "the camera and its mounting match, and is it the map of this place?");
  if (!moved_ && frames_ > 0) all.emplace_back("there is no odometry: motion between pictures is guessed");
  say(input_.not_forwards(), "motion sample", "left out, with stamps that do not go forwards: {}");
  say(input_.not_finite(), "motion sample", "left out, as not finite: {}");
  say(too_late_, "picture", "left out, as more than a second late: {}");
  say(crowded_, "tag", "left out, beyond the sixteenth of a picture: {}");
  say(input_.jumps(), "time",
      "odometry jumped {}, further than a robot can drive or after seconds of silence (set back, "
      "another "
      "clock, or two drives in one recording): the robot was looked for anew after each");
  say(tracker_.state().starts - 1 - input_.jumps() - tracker_.refused_starts() - tracker_.restarts(), "time",
      "tags contradicted where the robot was taken to be, and it was lost and found again, {}: it was "
      "carried, its wheels told the way wrongly, or pictures and motion are not stamped by one clock");
  if (tracker_.refused_starts() > 0)
    all.push_back(fmt::format("the tags that were seen do not agree with {}: the robot {}",
                              tracker_.restarts() > 0 ? "the pose that was given" : "the assumed start",
                              tracker_.state().mode == TrackMode::Certain
                                  ? "was localised from the tags alone"
                                  : "is not localised, as no two tags that agree were seen since"));
  if (camera_latency_ != given_camera_latency_)
    all.push_back(fmt::format(
        "the camera latency is {:.3f} s by the innovations, not {:.3f} s: that is used since it was found. "
        "Set it with `camera_latency_s`, or run `waymark calibrate robot` and give the result with "
        "`calibration`",
        to_seconds(camera_latency_), to_seconds(given_camera_latency_)));
  if (const auto& suspect = tracker_.suspect()) {
    all.push_back(describe(*suspect, tracker_.sees_corners()));
  } else if (const auto lasting = tracker_.lasting_nis(); lasting && *lasting > kLastingTooLarge) {
    all.push_back(
        fmt::format("means of innovations of one tag are {:.1f} times as large as assumed: the estimate is "
                    "overconfident. The tags are known worse than the map and `tag_sigma_m` say",
                    std::sqrt(*lasting)));
  }
  say(tracker_.broken(), "time", "the filter broke {} and began anew");
  return all;
}

}  // namespace waymark
