#include "waymark/pipeline/teacher.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark {
namespace {

/// Computes connected components (union-find with path halving).
class Groups {
 public:
  TagId root(TagId tag) {
    auto it = parent_.try_emplace(tag, tag).first;
    while (!(it->second == it->first)) {
      it->second = parent_.at(it->second);
      it = parent_.find(it->second);
    }
    return it->first;
  }
  /// Returns false if they were already connected.
  bool join(const TagId& a, const TagId& b) {
    const TagId root_a = root(a);
    const TagId root_b = root(b);
    if (root_a == root_b) return false;
    parent_.at(root_b) = root_a;
    return true;
  }

 private:
  std::map<TagId, TagId> parent_;
};

}  // namespace

void TagLinks::add(std::span<const TagId> tags, std::span<const TagId> beside) {
  for (std::size_t i = 0; i < tags.size(); ++i) {
    ++seen_[tags[i]];
    for (std::size_t k = 0; k < i; ++k) {
      if (tags[i] == tags[k]) continue;
      ++together_[std::minmax(tags[i], tags[k])];
    }
    for (const TagId& other : beside) {
      if (tags[i] != other) ++together_[std::minmax(tags[i], other)];
    }
  }
}

std::vector<TagLink> TagLinks::forest() const {
  std::vector<TagLink> links;
  for (const auto& [pair, frames] : together_) links.push_back({pair.first, pair.second, frames});
  std::ranges::stable_sort(links, std::ranges::greater(), &TagLink::frames);
  Groups groups;
  std::erase_if(links, [&](const TagLink& link) { return !groups.join(link.first, link.second); });
  return links;
}

std::vector<TagLink> TagLinks::weak(int frames) const {
  std::vector<TagLink> links = forest();
  std::erase_if(links, [&](const TagLink& link) { return link.frames >= frames; });
  std::ranges::reverse(links);
  return links;
}

std::vector<TagId> TagLinks::unreachable(const TagId& anchor) const {
  Groups groups;
  for (const TagLink& link : forest()) groups.join(link.first, link.second);
  std::vector<TagId> tags;
  for (const auto& [tag, frames] : seen_) {
    if (!(groups.root(tag) == groups.root(anchor))) tags.push_back(tag);
  }
  return tags;
}

namespace {

constexpr double kAnchorWindowSeconds = 10;  // maximum time between the start or the end and an observation
                                             // of the anchor
constexpr double kSamePlaceMetres = 1.0;     // maximum distance between those observations
constexpr double kMinObservations = 5;
constexpr int kMinLinkFrames = 5;        // minimum for a link that connects two parts of a map
constexpr double kJumpSeconds = 0.5;     // a working clock never makes larger steps
constexpr double kShortestMetres = 0.5;  // minimum length of a route that is not a loop

/// Whether a tag may be within PassedTags::kMaxRange_m, by its longest side in the image. A tag that is seen
/// obliquely still has a side that is not foreshortened.
bool is_near(const TagDetection& detection, double size_m, const CameraModel& camera) {
  const auto ahead = camera.project(Eigen::Vector3d(0, 0, 1));
  const auto beside = camera.project(Eigen::Vector3d(1e-3, 0, 1));
  if (!ahead || !beside) return true;
  const double focal_px = (*beside - *ahead).norm() / 1e-3;
  double side_px = 0;
  for (std::size_t i = 0; i < 4; ++i)
    side_px = std::max(side_px, (detection.corners_px[(i + 1) % 4] - detection.corners_px[i]).norm());
  return side_px * PassedTags::kMaxRange_m >= focal_px * size_m;
}

}  // namespace

double TeachSummary::two_tags_fraction() const {
  return frames > 0 ? 1.0 - static_cast<double>(low_observability_frames) / frames : 0.0;
}

Teacher::Teacher(TeachSetup setup) : setup_(std::move(setup)) {
  if (setup_.hull) passed_.emplace(*setup_.hull);
}

TaughtFrame Teacher::add(const TagFrame& frame) {
  TaughtFrame taught{.observed = observe(frame, setup_)};  // Algorithm 1, lines 5 and 9
  taught.map_T_cam = anchored(taught.observed);            // Algorithm 1, lines 11 to 13
  std::vector<TagId> tags;
  tags.reserve(taught.observed.tags.size());
  for (const TagPoseObservation& seen : taught.observed.tags) tags.push_back(seen.tag);
  count(frame.stamp, frame.camera, tags, taught.map_T_cam);    // Algorithm 1, line 15
  taught.low_observability = in_view_.count(frame.stamp) < 2;  // Algorithm 1, lines 6 and 7
  pass(taught.observed);
  return taught;
}

/// Equation 3.1 if the anchor is visible: the pose of the first camera, whichever camera observed the anchor.
std::optional<SE3> Teacher::anchored(const ObservedFrame& observed) const {
  std::optional<SE3> map_T_cam;
  for (const TagPoseObservation& seen : observed.tags) {
    if (seen.tag != setup_.anchor) continue;
    map_T_cam = setup_.map_T_anchor * seen.cam_T_tag.inverse();
    if (observed.base_T_cam) map_T_cam = *map_T_cam * observed.base_T_cam->inverse() * setup_.base_T_cam;
  }
  return map_T_cam;
}

void Teacher::watch(const TagFrame& frame) {
  std::vector<TagId> tags;
  TagFrame anchor{.stamp = frame.stamp, .camera = frame.camera};
  TagFrame near = anchor;
  const CameraModel& camera = camera_of(setup_, frame.camera).camera;
  for (const TagDetection& detection : frame.detections) {
    if (!setup_.sizes.size_m(detection.tag)) continue;
    if (!usable_corners(detection)) {
      ++counters_.unreliable;
      continue;
    }
    tags.push_back(detection.tag);
    if (detection.tag == setup_.anchor) anchor.detections.push_back(detection);
    if (passed_ && is_near(detection, *setup_.sizes.size_m(detection.tag), camera))
      near.detections.push_back(detection);
  }
  count(frame.stamp, frame.camera, tags, anchored(observe(anchor, setup_)));
  if (!near.detections.empty()) pass(observe(near, setup_));
}

/// Adds the tags near the robot to those that it may pass too closely.
void Teacher::pass(const ObservedFrame& observed) {
  if (!passed_) return;
  const SE3& base_T_cam = observed.base_T_cam ? *observed.base_T_cam : setup_.base_T_cam;
  std::vector<TagBesideRobot> beside;
  for (const TagPoseObservation& seen : observed.tags)
    beside.push_back(
        {seen.tag, *setup_.sizes.size_m(seen.tag), base_T_cam * seen.cam_T_tag, seen.ambiguity_ratio});
  passed_->add(observed.stamp, std::move(beside));
}

void Teacher::pass(const TagPoseFrame& frame) {
  if (!passed_) return;
  const SE3& base_T_cam = camera_of(setup_, frame.camera).base_T_cam;
  std::vector<TagBesideRobot> beside;
  for (const SeenTagPose& seen : frame.tags)
    if (const auto size_m = setup_.sizes.size_m(seen.tag))
      beside.push_back({.tag = seen.tag, .size_m = *size_m, .base_T_tag = base_T_cam * seen.cam_T_tag});
  passed_->add(frame.stamp, std::move(beside));
}

void Teacher::watch(const TagPoseFrame& frame) {
  std::vector<TagId> tags;
  std::optional<SE3> map_T_cam;
  for (const SeenTagPose& seen : frame.tags) {
    tags.push_back(seen.tag);
    if (seen.tag == setup_.anchor) map_T_cam = setup_.map_T_anchor * seen.cam_T_tag.inverse();
  }
  count(frame.stamp, frame.camera, tags, map_T_cam);
  pass(frame);
}

void Teacher::count(SensorTime stamp, const std::string& camera, const std::vector<TagId>& tags,
                    const std::optional<SE3>& map_T_cam) {
  receive(stamp, true);
  clocks_.add(StampedKind::Observations, stamp);
  in_view_.add(camera, stamp, tags);
  if (!first_) first_ = last_tag_ = stamp;
  last_ = stamp;
  ++counters_.frames;
  counters_.detections += static_cast<int>(tags.size());
  counters_.low_observability_frames += in_view_.count(stamp) < 2 ? 1 : 0;
  for (const TagId& tag : tags) ++counters_.seen[tag];
  links_.add(tags, in_view_.beside(camera, stamp));
  if (!tags.empty()) last_tag_ = stamp;
  counters_.longest_blind_s = std::max(counters_.longest_blind_s, to_seconds(stamp - last_tag_));
  if (map_T_cam) keep_anchor_observation(stamp, *map_T_cam);
}

void Teacher::keep_anchor_observation(SensorTime stamp, const SE3& map_T_cam) {
  if (!first_anchored_cam_) first_anchored_cam_ = StampedPose{stamp, map_T_cam};
  const Eigen::Vector3d apart = map_T_cam.translation() - first_anchored_cam_->map_T_base.translation();
  last_anchor_observations_.push_back({stamp, apart.norm(), counters_.distance_m});
  while (to_seconds(stamp - last_anchor_observations_.front().stamp) > kAnchorWindowSeconds)
    last_anchor_observations_.pop_front();
}

/// If the lap overlaps its start, one of the observations is made from nearly the same position, but the last
/// one is made at the end of the overlap.
bool Teacher::came_back(SensorTime since) const {
  return std::ranges::any_of(last_anchor_observations_, [since](const AnchorObservation& seen) {
    return seen.stamp >= since && seen.apart_m < kSamePlaceMetres && seen.driven_m > 2 * kSamePlaceMetres;
  });
}

/// Samples of different kinds are only approximately in order. An image with an earlier timestamp than other
/// samples is merely late if the images themselves remain in order; their timestamps go back only if the
/// clock was reset.
void Teacher::receive(SensorTime stamp, bool is_frame) {
  const double since_s = received_ ? to_seconds(stamp - *received_) : 0;
  const bool goes_on = !newest_frame_ || stamp >= *newest_frame_;
  if (is_frame) newest_frame_ = stamp;
  if (since_s < -kJumpSeconds && goes_on && is_frame) {
    counters_.image_arrival_delay_s = std::max(counters_.image_arrival_delay_s, -since_s);
    return;
  }
  if (since_s < -kJumpSeconds) counters_.clock_back_s = std::max(counters_.clock_back_s, -since_s);
  counters_.longest_silence_s = std::max(counters_.longest_silence_s, since_s);
  received_ = stamp;
}

void Teacher::add(const Odometry& odometry) {
  receive(odometry.stamp, false);
  clocks_.add(StampedKind::Odometry, odometry.stamp);
  const bool jumped = odometry_ && odometry_jumped(*odometry_, odometry);
  counters_.odometry_jumps += jumped ? 1 : 0;
  if (odometry_ && !jumped) {
    counters_.distance_m += (odometry_->odom_T_base.inverse() * odometry.odom_T_base).translation().norm();
  }
  follow(odometry, jumped);
  odometry_ = odometry;
}

/// Extends the driven line. Poses that are closer together than the steps of a route are not needed.
void Teacher::follow(const Odometry& odometry, bool jumped) {
  constexpr double kStep_m = 0.01;
  if (jumped) driven_T_odom_ = driven_T_odom_ * odometry_->odom_T_base * odometry.odom_T_base.inverse();
  if (passed_) {
    if (jumped) passed_->forget();
    passed_->add(odometry);
  }
  const SE3 driven_T_base = lift(driven_T_odom_ * odometry.odom_T_base);
  if (!driven_.empty() &&
      (driven_T_base.translation() - driven_.back().map_T_base.translation()).norm() < kStep_m)
    return;
  driven_.push_back({odometry.stamp, driven_T_base});
}

/// Samples by two clocks cannot be compared, so neither a jump of the clock nor a silence is known.
void Teacher::compare_clocks(TeachSummary& summary) const {
  summary.clocks_apart_s = clocks_.apart_s(StampedKind::Odometry);
  if (!summary.clocks_apart_s) return;
  summary.clock_back_s = summary.longest_silence_s = summary.image_arrival_delay_s = 0;
  summary.warnings.push_back(to_string(clocks_.mismatch()->error));
}

/// Warns about a lap that a replay cannot drive.
void Teacher::warn_of_route(TeachSummary& summary) const {
  if (const auto route = build_route(driven_, {.closing_distance_m = 0}))
    summary.sideways = sideways_motion(*route);
  if (passed_) summary.nearest_tag = passed_->nearest();
  if (summary.sideways) summary.warnings.push_back(describe(*summary.sideways));
  if (!summary.nearest_tag || summary.sideways) return;
  std::string words = describe_too_near(*summary.nearest_tag);
  if (!words.empty()) summary.warnings.push_back(std::move(words));
}

/// Warns about tags that are weakly connected to the others, or not at all.
void Teacher::warn_of_links(TeachSummary& summary) const {
  summary.weak_links = links_.weak(kMinLinkFrames);
  summary.unreachable = links_.unreachable(setup_.anchor);
  for (const TagLink& link : summary.weak_links) {
    summary.warnings.push_back(fmt::format(
        "{} and {} are together in only {} frames, and nothing else connects the two parts of the map there: "
        "drive slowly where both are in view",
        to_string(link.first), to_string(link.second), link.frames));
  }
  if (summary.unreachable.empty() || !first_anchored_cam_) return;
  std::string names;
  for (const TagId& tag : summary.unreachable) names += (names.empty() ? "" : ", ") + to_string(tag);
  summary.warnings.push_back(fmt::format(
      "placed by odometry alone, because never seen together with a tag that is connected to the anchor: "
      "{}. Add a tag in between, or observe both from one position",
      names));
}

void Teacher::warn_of_stamps(TeachSummary& summary) const {
  if (summary.clock_back_s > 0)
    summary.warnings.push_back(fmt::format(
        "the sensors' clock went back by {:.2f} s, so observations before and after cannot be ordered: drive "
        "the lap again",
        summary.clock_back_s));
  if (summary.odometry_jumps > 0)
    summary.warnings.push_back(fmt::format(
        "odometry jumped {}, as after a restart of the robot or a reset of its odometry, so the motion in "
        "between is unknown: drive the lap again",
        counted(summary.odometry_jumps, "time")));
  if (summary.image_arrival_delay_s > 0)
    summary.warnings.push_back(
        fmt::format("images arrived up to {:.2f} s later than odometry of the same time, so a replay would "
                    "use outdated images. Check the delay between the camera and this program",
                    summary.image_arrival_delay_s));
  if (summary.longest_silence_s > kJumpSeconds)
    summary.warnings.push_back(
        fmt::format("no sample of camera and odometry for {:.2f} s: they failed, or their clock jumped ahead",
                    summary.longest_silence_s));
}

bool Teacher::long_enough(const TeachSummary& summary) const {
  return setup_.closed_route ? summary.closed_loop : summary.distance_m >= kShortestMetres;
}

void Teacher::warn_of_views(TeachSummary& summary) const {
  const auto warn = [&](bool condition, std::string words) {
    if (condition) summary.warnings.push_back(std::move(words));
  };
  warn(!first_anchored_cam_, fmt::format("the anchor {} was never observed, so the map cannot be placed",
                                         to_string(setup_.anchor)));
  warn(first_anchored_cam_ && !summary.anchor_at_start,
       "the anchor was not observed at the start: begin the lap in front of it");
  warn(first_anchored_cam_ && !summary.anchor_at_end && setup_.closed_route,
       "the anchor was not observed at the end: continue until it is in view again");
  warn(setup_.closed_route && summary.anchor_at_start && summary.anchor_at_end && !summary.closed_loop,
       fmt::format(
           "the lap did not return to its start ({:.2f} m driven): drive all of it, and one metre more",
           summary.distance_m));
  warn(!setup_.closed_route && summary.distance_m < kShortestMetres,
       fmt::format("{:.2f} m driven is too short for a route", summary.distance_m));
  warn(summary.seen.size() < 2, "fewer than two tags were observed; a map needs two");
  warn(summary.two_tags_fraction() < 0.9,
       fmt::format("two tags were in view only {:.0f} % of the time: add tags or drive farther from them",
                   100 * summary.two_tags_fraction()));
  for (const auto& [tag, frames] : summary.seen) {
    warn(frames < kMinObservations,
         fmt::format("{} was observed in only {} frames: its position will be inaccurate", to_string(tag),
                     frames));
  }
}

TeachSummary Teacher::summary() const {
  TeachSummary summary = counters_;
  if (!first_) {
    summary.warnings.emplace_back("no camera frame received");
    return summary;
  }
  summary.duration_s = to_seconds(last_ - *first_);
  const double window_s = std::min(kAnchorWindowSeconds, summary.duration_s / 3);
  summary.anchor_at_start =
      first_anchored_cam_ && to_seconds(first_anchored_cam_->stamp - *first_) <= window_s;
  const SensorTime last_window = last_ - Duration(static_cast<std::int64_t>(window_s * 1e9));
  summary.anchor_at_end =
      !last_anchor_observations_.empty() && last_anchor_observations_.back().stamp >= last_window;
  summary.closed_loop = summary.anchor_at_start && summary.anchor_at_end && came_back(last_window);
  compare_clocks(summary);
  summary.mappable = first_anchored_cam_.has_value() && summary.seen.size() >= 2 &&
                     summary.clock_back_s == 0 && summary.odometry_jumps == 0 && !summary.clocks_apart_s &&
                     long_enough(summary);

  warn_of_views(summary);
  warn_of_links(summary);
  warn_of_stamps(summary);
  warn_of_route(summary);
  return summary;
}

namespace {

constexpr double kTooManyBlurred = 0.05;

}  // namespace

void TeachMonitor::add(const Sample& sample) {
  if (const auto* odometry = std::get_if<Odometry>(&sample)) follow(*odometry);
  if (const auto* frame = std::get_if<TagFrame>(&sample)) count(frame->camera, frame->detections.size());
  if (const auto* frame = std::get_if<TagPoseFrame>(&sample)) count(frame->camera, frame->tags.size());
}

void TeachMonitor::count(const std::string& camera, std::size_t tags) {
  tags_[camera] = tags;
  ++frames_;
  const double blur = motion_blur_px();
  blurred_frames_ += blur > options_.blur_px ? 1 : 0;
  worst_blur_px_ = std::max(worst_blur_px_, blur);
}

void TeachMonitor::follow(const Odometry& odometry) {
  yaw_rate_rad_s_ = odometry.yaw_rate_rad_s;
  // If the clock jumped back, the window starts again.
  if (!speeds_.empty() && odometry.stamp <= speeds_.back().stamp) speeds_.clear();
  speeds_.push_back({odometry.stamp, odometry.speed_m_s});
  while (to_seconds(speeds_.back().stamp - speeds_.front().stamp) > options_.window_s) speeds_.pop_front();
  const bool abrupt = std::abs(acceleration_m_s2()) > options_.acceleration_m_s2;
  abrupt_moments_ += abrupt && !abrupt_ ? 1 : 0;
  abrupt_ = abrupt;
}

double TeachMonitor::motion_blur_px() const {
  return std::abs(yaw_rate_rad_s_) * options_.exposure_ms * 1e-3 * options_.focal_length_px;
}

double TeachMonitor::acceleration_m_s2() const {
  if (speeds_.size() < 2) return 0;
  const double dt_s = to_seconds(speeds_.back().stamp - speeds_.front().stamp);
  return dt_s < options_.window_s / 2 ? 0 : (speeds_.back().m_s - speeds_.front().m_s) / dt_s;
}

std::vector<std::string> TeachMonitor::live() const {
  std::vector<std::string> words;
  if (motion_blur_px() > options_.blur_px)
    words.push_back(fmt::format("motion blur {:.1f} px: turn more slowly", motion_blur_px()));
  if (abrupt_) words.push_back(fmt::format("abrupt acceleration {:+.1f} m/s2", acceleration_m_s2()));
  std::size_t tags = tags_.empty() ? 2 : 0;
  for (const auto& [camera, in_view] : tags_) tags += in_view;
  if (tags < 2) words.emplace_back(tags == 1 ? "only one tag" : "no tag");
  return words;
}

std::vector<std::string> TeachMonitor::summary() const {
  std::vector<std::string> words;
  if (frames_ > 0 && blurred_frames_ > kTooManyBlurred * frames_)
    words.push_back(fmt::format(
        "{:.0f} % of the frames have more than {:g} px of motion blur (up to {:.1f} px): turn more "
        "slowly, or use more light and a shorter exposure",
        100.0 * blurred_frames_ / frames_, options_.blur_px, worst_blur_px_));
  if (abrupt_moments_ > 0)
    words.push_back(
        fmt::format("the speed changed abruptly {} times (more than {:g} m/s2): this makes wheels slip, so "
                    "start and stop gently",
                    abrupt_moments_, options_.acceleration_m_s2));
  return words;
}

}  // namespace waymark
