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
/// If the square of the ratio (2) between actual and assumed means of innovations exceeds this, problems()
/// reports overconfidence.
constexpr double kLastingTooLarge = 4;
/// A larger share of detections with unreliable corners is reported.
constexpr double kManyUnreliable = 0.02;
/// Maximum time for which a frame waits for odometry.
constexpr Duration kMaxWait = std::chrono::milliseconds(250);

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

/// Late samples from before the restart belong to the previous estimate, so snapshots before it are
/// discarded.
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

/// Rewinds to a time before `before`. Returns false if that is older than all snapshots.
bool RiekfLocalizer::rewind(SensorTime before) {
  while (snapshot_count_ > 0 && snapshot_at(snapshot_count_ - 1).stamp >= before) --snapshot_count_;
  if (snapshot_count_ == 0) return false;
  tracker_.restore(snapshot_at(snapshot_count_ - 1));
  ++rewinds_;
  return true;
}

/// A slot for a frame with this stamp; nullptr if the frame is too late.
FrameObservations* RiekfLocalizer::place(SensorTime stamp) {
  const TrackState& now = tracker_.state();
  if (!now.started) {
    if (timeline_.empty() && moved_) return nullptr;  // before the first motion
    tracker_.start_at(stamp);
  }
  if (stamp < now.stamp) {
    const bool reachable = snapshot_count_ > 0 && snapshot_at(0).stamp < stamp;
    if (!reachable) {
      if (now.stamp - stamp > kWindow) ++too_late_;  // otherwise, it is from before the initialisation
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

/// Processes frames in order, until no more motion is available.
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

/// Extrapolates the motion for a frame whose odometry did not arrive in time.
void RiekfLocalizer::cover(SensorTime stamp) {
  const SensorTime covered = std::max(timeline_.covered(), tracker_.state().stamp);
  if (stamp <= covered || (moved_ && stamp - covered < kMaxWait)) return;
  timeline_.add(input_.guess(covered, stamp));
}

/// Takes one Gauss-Newton step whenever the innovations show a significant error; evidence is then collected
/// again from zero.
void RiekfLocalizer::correct_camera_latency() {
  constexpr Eigen::Index kCameraLatencyIndex = 7;
  constexpr Duration kMaxCorrection = std::chrono::milliseconds(300);
  const auto& suspect = tracker_.suspect();
  if (!estimates_camera_latency_ || !suspect || suspect->suspect != Suspect::CameraLatency ||
      !tracker_.sees_corners())
    return;
  const Duration found =
      camera_latency_ + Duration(std::llround(suspect->fit.value[kCameraLatencyIndex] * 1e9));
  if (found - given_camera_latency_ > kMaxCorrection || given_camera_latency_ - found > kMaxCorrection)
    return;
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
    unreliable_ += known && !usable_corners(detection) ? 1 : 0;
    if (!known && tracker_.landmarks().find(std::int64_t{detection.tag.number}) >= 0)
      other_family_ = detection.tag.family;
    if (!observation) continue;
    if (slot->count < FrameObservations::kMaxObservations)
      slot->seen[slot->count++] = *observation;
    else
      ++over_limit_;
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
  } else if (segment->from < covered && covered < segment->to) {  // part of this segment was extrapolated
    segment->step = segment->part(covered, segment->to);
    segment->step.share = 1;  // the extrapolated part has an independent error
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
  const auto report = [&](int count, const char* thing, const char* text) {
    if (count > 0) all.push_back(fmt::format(fmt::runtime(text), counted(count, thing)));
  };
  if (frames_ > 0 && observations_ == 0)
    all.emplace_back(
        "no tag was detected in any image. Check that tags were in view and that their family was searched");
  if (observations_ > 0 && mapped_ == 0)
    all.push_back(other_family_
                      ? fmt::format("the observed tags are of family {}, those of the map are not. Is it the "
                                    "map of this place?",
                                    to_string(*other_family_))
                      : "none of the observed tags is in the map. Is it the map of this place?");
  if (tracker_.state().starts == 0 && mapped_ > 0)
    all.emplace_back(
        "no two map tags in view ever agreed on the pose of the robot. Check that two tags are visible at "
        "once, "
        "that tag sizes, camera and mounting are correct, and that it is the map of this place");
  if (!moved_ && frames_ > 0) all.emplace_back("no odometry; the motion between images is extrapolated");
  report(input_.not_forwards(), "motion sample", "ignored because their stamps do not increase: {}");
  report(input_.not_finite(), "motion sample", "ignored because they are not finite: {}");
  report(too_late_, "image", "ignored because they are more than 1 s late: {}");
  report(over_limit_, "tag", "ignored beyond the limit of 16 per image: {}");
  if (unreliable_ > kManyUnreliable * mapped_)
    report(unreliable_, "detection", "not used because their corners are unreliable: {}");
  report(input_.jumps(), "time",
         "odometry jumped {}: farther than a robot can drive, or after seconds of silence (counter reset, "
         "another clock, or two drives in one recording). The pose was re-initialised after each jump");
  report(
      tracker_.state().starts - 1 - input_.jumps() - tracker_.refused_starts() - tracker_.restarts(), "time",
      "tags contradicted the estimate, and the pose was lost and recovered {}. The robot was moved by hand, "
      "wheel odometry is wrong, or images and odometry are stamped by different clocks");
  if (tracker_.refused_starts() > 0)
    all.push_back(fmt::format("the observed tags contradict {}; the robot {}",
                              tracker_.restarts() > 0 ? "the given pose" : "the assumed start",
                              tracker_.state().mode == TrackMode::Certain
                                  ? "was localised from the tags alone"
                                  : "is not localised, because no two tags have agreed since"));
  if (camera_latency_ != given_camera_latency_)
    all.push_back(fmt::format(
        "the innovations show a camera latency of {:.3f} s instead of {:.3f} s; it is used since it was "
        "found. "
        "Set it with `camera_latency_s`, or run `waymark calibrate robot` and pass the result with "
        "`calibration`",
        to_seconds(camera_latency_), to_seconds(given_camera_latency_)));
  if (const auto& suspect = tracker_.suspect()) {
    all.push_back(describe(*suspect, tracker_.sees_corners()));
  } else if (const auto lasting = tracker_.lasting_nis(); lasting && *lasting > kLastingTooLarge) {
    all.push_back(fmt::format(
        "means of the innovations of one tag are {:.1f} times as large as assumed: the estimate is "
        "overconfident, because tag errors exceed those of the map and of `tag_sigma_m`",
        std::sqrt(*lasting)));
  }
  report(tracker_.broken(), "time", "the filter diverged and was re-initialised {}");
  return all;
}

}  // namespace waymark
