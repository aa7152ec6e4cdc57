#include "waymark/mapping/scene/scene_bundle.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>

#include "waymark/base/order_statistics.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

double area_px2(const TagDetection& detection) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = detection.corners_px[i];
    const Eigen::Vector2d& b = detection.corners_px[(i + 1) % 4];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

/// The tags by id, including unlisted tags found in the recording.
class Owners {
 public:
  explicit Owners(TagScene& scene) : scene_(scene) {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      for (std::size_t t = 0; t < scene.bodies[b].tags.size(); ++t)
        owner_.try_emplace(scene.bodies[b].tags[t].id.number, b, t);
      ignored_.insert(scene.bodies[b].ignored.begin(), scene.bodies[b].ignored.end());
    }
  }

  [[nodiscard]] bool ignored(int id) const { return ignored_.contains(id); }

  std::optional<std::pair<std::size_t, std::size_t>> find(const TagId& id) {
    const auto it = owner_.find(id.number);
    if (it != owner_.end()) return it->second;
    if (!scene_.default_body) return std::nullopt;
    SceneBody& body = scene_.bodies[*scene_.default_body];
    if (!(body.default_tag_size_m > 0)) return std::nullopt;
    body.tags.push_back({.id = id, .size_m = body.default_tag_size_m});
    return owner_[id.number] = {*scene_.default_body, body.tags.size() - 1};
  }

 private:
  TagScene& scene_;
  std::map<int, std::pair<std::size_t, std::size_t>> owner_;
  std::set<int> ignored_;
};

/// The stamp of the frame that each squash refers to. It is the frame nearest to the squash's time, at most
/// half a frame period away; empty if the squash has no time.
std::vector<std::optional<SensorTime>> stamps_of_squashes(const SceneRecording& recording,
                                                          const TagScene& scene) {
  const std::vector<SceneFrame>& frames = recording.frames;
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].stamp - frames[i - 1].stamp);
  const Duration half = steps.empty() ? Duration::zero() : median(std::move(steps)) / 2;
  std::vector<std::optional<SensorTime>> stamps;
  for (const SceneSquash& squash : scene.squash) {
    stamps.push_back(squash.stamp);
    if (!squash.stamp || frames.empty()) continue;
    const auto nearest = std::ranges::min_element(
        frames, {}, [&](const SceneFrame& frame) { return std::chrono::abs(frame.stamp - *squash.stamp); });
    if (std::chrono::abs(nearest->stamp - *squash.stamp) <= half) stamps.back() = nearest->stamp;
  }
  return stamps;
}

bool squashed(const TagScene& scene, const std::vector<std::optional<SensorTime>>& stamps,
              const std::string& camera, SensorTime stamp, int id) {
  for (std::size_t i = 0; i < scene.squash.size(); ++i) {
    const SceneSquash& squash = scene.squash[i];
    if ((!stamps[i] || *stamps[i] == stamp) && (squash.camera.empty() || squash.camera == camera) &&
        squash.ids.contains(id))
      return true;
  }
  return false;
}

int remapped(const TagScene& scene, const std::string& camera, SensorTime stamp, int id) {
  // Rounding error of times stored as seconds in a double.
  constexpr Duration kRounding = std::chrono::microseconds(1);
  for (const SceneRemap& remap : scene.remaps) {
    if (remap.id == id && stamp >= remap.from - kRounding && stamp <= remap.to + kRounding &&
        (remap.camera.empty() || remap.camera == camera))
      return remap.becomes;
  }
  return id;
}

using Outline = std::array<Eigen::Vector2d, 4>;

/// Whether the line along one side of an outline separates it from another one.
bool is_separated_by_side(const Outline& outline, const Outline& other) {
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d side = outline[(k + 1) % 4] - outline[k];
    const Eigen::Vector2d normal(-side.y(), side.x());
    const double inside = normal.dot(outline[(k + 2) % 4] - outline[k]);
    if (std::ranges::all_of(
            other, [&](const Eigen::Vector2d& px) { return inside * normal.dot(px - outline[k]) <= 0; }))
      return true;
  }
  return false;
}

/// The outline of a tag, smaller by more than the errors of its corners.
Outline inner_outline(const CornerFactor& factor) {
  constexpr double kShare = 0.8;
  Outline outline = factor.corners_px;
  const Eigen::Vector2d centre = (outline[0] + outline[1] + outline[2] + outline[3]) / 4;
  for (Eigen::Vector2d& px : outline) px = centre + kShare * (px - centre);
  return outline;
}

/// Whether two observations of an id in one view show two tags: their outlines do not overlap, however
/// obliquely they are seen. A detector may also find one tag twice.
bool are_two_tags(const CornerFactor& a, const CornerFactor& b) {
  const Outline of_a = inner_outline(a);
  const Outline of_b = inner_outline(b);
  return is_separated_by_side(of_a, of_b) || is_separated_by_side(of_b, of_a);
}

/// The observations that repeat an id of the same view, and where they are.
class Repetitions {
 public:
  explicit Repetitions(RepeatedIds repeated) : repeated_(repeated) {}

  void start_view(const SceneObservations& all) { first_of_view_ = all.seen.size(); }

  /// Adds an observation. Counts it as repeated instead if its id was already observed at this place.
  void add(SceneObservation&& now, SceneObservations& all) {
    bool repeats = false;
    for (std::size_t i = first_of_view_; i < all.seen.size(); ++i) {
      const SceneObservation& other = all.seen[i];
      if (other.body != now.body || other.tag != now.tag) continue;
      repeats = true;
      if (repeated_ == RepeatedIds::All && are_two_tags(other.factor, now.factor)) continue;
      ++all.repeated;
      return;
    }
    if (repeats) at_.push_back(all.seen.size());
    if (repeats) ++views_[{now.body, now.tag}];
    all.seen.push_back(std::move(now));
  }

  /// Removes the repetitions of ids that are repeated in only a few views.
  void drop_rare(SceneObservations& all) const {
    constexpr int kMinViews = 4;
    std::vector<char> rare(all.seen.size(), 0);
    for (const std::size_t i : at_)
      rare[i] = views_.at({all.seen[i].body, all.seen[i].tag}) < kMinViews ? 1 : 0;
    all.repeated += static_cast<int>(std::ranges::count(rare, 1));
    std::size_t i = 0;
    std::erase_if(all.seen, [&](const SceneObservation&) { return rare[i++] != 0; });
  }

 private:
  RepeatedIds repeated_;
  std::size_t first_of_view_ = 0;
  std::vector<std::size_t> at_{};
  std::map<std::pair<std::size_t, std::size_t>, int> views_{};  ///< for each body and tag
};

}  // namespace

SceneObservations observations_of(const SceneRecording& recording, TagScene& scene, RepeatedIds repeated) {
  SceneObservations result;
  Repetitions repetitions(repeated);
  Owners owners(scene);
  const std::vector<std::optional<SensorTime>> squashes = stamps_of_squashes(recording, scene);
  for (std::size_t f = 0; f < recording.frames.size(); ++f) {
    const SceneFrame& frame = recording.frames[f];
    for (const SceneView& view : frame.views) {
      const std::string& camera = scene.cameras[view.camera].name;
      repetitions.start_view(result);
      for (const TagDetection& detection : view.detections) {
        if (detection.hamming > scene.max_hamming ||
            squashed(scene, squashes, camera, frame.stamp, detection.tag.number) ||
            area_px2(detection) < scene.min_tag_area_px2) {
          ++result.squashed;
          continue;
        }
        const TagId id{detection.tag.family, remapped(scene, camera, frame.stamp, detection.tag.number)};
        if (owners.ignored(id.number)) {
          ++result.squashed;
          continue;
        }
        const auto owner = owners.find(id);
        if (!owner) {
          ++result.foreign[id];
          continue;
        }
        const SceneBody& body = scene.bodies[owner->first];
        if (body.max_hamming && detection.hamming > *body.max_hamming) {
          ++result.squashed;
          continue;
        }
        if (!usable_corners(detection)) {
          ++result.unreliable;
          continue;
        }
        TagDetection named = detection;
        named.tag = id;
        const auto factor = corner_factor(named, body.tags[owner->second].size_m, scene.pixel_sigma_px);
        if (!factor) {
          ++result.broken;
          continue;
        }
        repetitions.add({f, view.camera, owner->first, owner->second, *factor}, result);
      }
    }
  }
  repetitions.drop_rare(result);
  return result;
}

namespace {

void add_poses(const TagScene& scene, std::size_t frames, SceneBundle& problem) {
  Bundle& bundle = problem.bundle;
  const auto add = [&](const std::optional<ScenePrior>& prior, bool moves) {
    problem.moves.push_back(moves ? 1 : 0);
    const PoseIndex pose = bundle.add(prior ? prior->mean : SE3());
    if (prior) bundle.priors.push_back({pose, prior->factor()});
    return pose;
  };
  for (const CameraOnBody& camera : scene.cameras) {
    bundle.cameras.push_back(camera.model);
    problem.cameras.push_back(add(camera.body_T_cam, false));
  }
  for (const SceneBody& body : scene.bodies) {
    problem.bodies.emplace_back();
    problem.tags.emplace_back();
    for (std::size_t i = 0; i < (body.is_static ? 1 : frames); ++i)
      problem.bodies.back().push_back(add(body.is_static ? body.map_T_body : std::nullopt, !body.is_static));
    problem.sizes.emplace_back();
    for (const SceneTag& tag : body.tags) {
      problem.tags.back().push_back(add(tag.body_T_tag, false));
      problem.sizes.back().push_back(bundle.sizes.size());
      bundle.sizes.emplace_back();
    }
  }
}

/// Poses of an odometry sensor at ascending times. A pose is interpolated, or it is the nearest sample that
/// was not used for an earlier time.
class OdometryInTime {
 public:
  OdometryInTime(const std::vector<const SceneOdometry*>& samples, bool nearest)
      : samples_(samples), nearest_(nearest) {}

  std::optional<SE3> at(SensorTime stamp) {
    const auto first = samples_.begin() + static_cast<std::ptrdiff_t>(taken_);
    const auto after =
        std::lower_bound(first, samples_.end(), stamp,
                         [](const auto* sample, SensorTime time) { return sample->stamp < time; });
    if (nearest_) return take(after, first, stamp);
    if (after == samples_.end()) return std::nullopt;
    if ((*after)->stamp == stamp) return (*after)->odom_T_sensor;
    if (after == samples_.begin()) return std::nullopt;
    const SceneOdometry& a = **(after - 1);
    const SceneOdometry& b = **after;
    const double share = to_seconds(stamp - a.stamp) / to_seconds(b.stamp - a.stamp);
    return a.odom_T_sensor * SE3::exp(share * (a.odom_T_sensor.inverse() * b.odom_T_sensor).log());
  }

 private:
  using Place = std::vector<const SceneOdometry*>::const_iterator;

  std::optional<SE3> take(Place after, Place first, SensorTime stamp) {
    if (first == samples_.end()) return std::nullopt;
    const bool before = after == samples_.end() ||
                        (after != first && stamp - (*(after - 1))->stamp < (*after)->stamp - stamp);
    const Place chosen = before ? after - 1 : after;
    taken_ = static_cast<std::size_t>(chosen - samples_.begin()) + 1;
    return (*chosen)->odom_T_sensor;
  }

  const std::vector<const SceneOdometry*>& samples_;
  bool nearest_;
  std::size_t taken_ = 0;
};

/// Noise of a motion, which is either constant or computed from the deviation from the last motion.
class MotionNoise {
 public:
  explicit MotionNoise(const SceneMotionNoise& noise) : noise_(noise) {}

  Matrix6 whitening(const SE3& motion, double dt_s) {
    double sigma_m = noise_.sigma_m;
    double sigma_rad = noise_.sigma_rad;
    if (!(sigma_m > 0 && sigma_rad > 0)) {
      const double dt = std::max(dt_s, 0.001);
      const Eigen::Vector3d turn = motion.rotation().log();
      const double dt2 = dt * dt;
      sigma_m = std::clamp((motion.translation() - velocity_ * dt).norm(), noise_.acceleration_min_m_s2 * dt2,
                           noise_.acceleration_max_m_s2 * dt2);
      sigma_rad = std::clamp((turn - turning_ * dt).norm(), noise_.angular_min_rad_s2 * dt2,
                             noise_.angular_max_rad_s2 * dt2);
      velocity_ = motion.translation() / dt;
      turning_ = turn / dt;
    }
    Vector6 sigma;
    sigma << Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad);
    return sigma.cwiseInverse().asDiagonal();
  }

 private:
  SceneMotionNoise noise_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d turning_ = Eigen::Vector3d::Zero();
};

void add_odometry(const SceneBody& body, const std::vector<const SceneOdometry*>& samples,
                  const SceneRecording& recording, const std::vector<PoseIndex>& poses,
                  SceneBundle& problem) {
  const std::vector<SceneFrame>& frames = recording.frames;
  MotionNoise noise(body.odometry);
  OdometryInTime sensor(samples, recording.nearest_odometry);
  std::optional<SE3> last;
  std::size_t last_frame = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::optional<SE3> now = sensor.at(frames[i].stamp);
    if (!now) continue;
    if (last) {
      const SE3 motion = body.body_T_odom * last->inverse() * *now * body.body_T_odom.inverse();
      const double dt_s = to_seconds(frames[i].stamp - frames[last_frame].stamp);
      problem.odometry.push_back({problem.bundle.relatives.size(), last_frame, i});
      problem.bundle.relatives.push_back(
          {poses[last_frame], poses[i], {motion, {}, noise.whitening(motion, dt_s)}});
    }
    last = now;
    last_frame = i;
  }
}

void add_motion(const TagScene& scene, const SceneRecording& recording, SceneBundle& problem) {
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SceneBody& body = scene.bodies[b];
    if (body.is_static) continue;
    std::vector<const SceneOdometry*> samples;
    for (const SceneOdometry& sample : recording.odometry) {
      if (sample.body == b && (samples.empty() || samples.back()->stamp < sample.stamp))
        samples.push_back(&sample);
    }
    if (!samples.empty()) add_odometry(body, samples, recording, problem.bodies[b], problem);
    if (!samples.empty() || !body.stays_put) continue;
    MotionNoise noise(*body.stays_put);
    for (std::size_t i = 1; i < recording.frames.size(); ++i) {
      problem.bundle.relatives.push_back(
          {problem.bodies[b][i - 1], problem.bodies[b][i], {SE3(), {}, noise.whitening(SE3(), 1)}});
    }
  }
}

void add_measurements(const TagScene& scene, SceneBundle& problem) {
  const auto point = [&](int id, int corner) -> std::optional<BundlePoint> {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      for (std::size_t t = 0; t < scene.bodies[b].tags.size(); ++t) {
        const SceneTag& tag = scene.bodies[b].tags[t];
        if (tag.id.number != id || !scene.bodies[b].is_static) continue;
        const Eigen::Vector3d p = corner < 0 ? Eigen::Vector3d::Zero().eval()
                                             : tag_corners(tag.size_m)[static_cast<std::size_t>(corner)];
        return BundlePoint{problem.bodies[b].front(), problem.tags[b][t], p};
      }
    }
    return std::nullopt;
  };
  for (const SceneDistance& d : scene.distances) {
    const auto a = point(d.tag_a, d.corner_a);
    const auto b = point(d.tag_b, d.corner_b);
    if (a && b) problem.bundle.point_distances.push_back({*a, *b, d.measured_m, d.sigma_m});
  }
  for (const SceneCoordinate& c : scene.coordinates) {
    if (const auto p = point(c.tag, c.corner))
      problem.bundle.point_coordinates.push_back({*p, c.direction.normalized(), c.measured_m, c.sigma_m});
  }
  for (const SceneDirection& d : scene.directions) {
    if (const auto p = point(d.tag, -1)) problem.bundle.directions.push_back({p->body, p->tag, d.factor});
  }
}

/// Without any prior in the map frame, fixes a body and a tag on it.
Status fix_one_body(const TagScene& scene, const SceneObservations& observations, SceneBundle& problem) {
  std::size_t anchored = scene.bodies.size();
  for (std::size_t b = scene.bodies.size(); b-- > 0;) {
    if (scene.bodies[b].is_static && scene.bodies[b].map_T_body) anchored = b;
  }
  for (std::size_t b = scene.bodies.size(); anchored == scene.bodies.size() && b-- > 0;) {
    if (scene.bodies[b].is_static) anchored = scene.default_body && *scene.default_body == b ? b : anchored;
  }
  for (std::size_t b = 0; anchored == scene.bodies.size() && b < scene.bodies.size(); ++b) {
    if (scene.bodies[b].is_static) anchored = b;
  }
  if (anchored == scene.bodies.size())
    return fail(ErrorCode::InvalidArgument, "every body moves, so the map frame is undefined",
                {.key = "bodies"}, "Set `is_static: true` for one body.");
  if (!scene.bodies[anchored].map_T_body) problem.bundle.poses[problem.bodies[anchored].front()].fixed = true;
  const auto on_it = [&](const CameraOnBody& camera) { return camera.body == anchored && camera.body_T_cam; };
  const auto known = [](const SceneTag& tag) { return tag.body_T_tag.has_value(); };
  bool tied = std::ranges::any_of(scene.cameras, on_it);
  for (const SceneBody& body : scene.bodies) {
    if (body.is_static && body.map_T_body) tied = tied || std::ranges::any_of(body.tags, known);
  }
  if (tied || std::ranges::any_of(scene.bodies[anchored].tags, known) || problem.tags[anchored].empty())
    return {};
  std::vector<int> seen(problem.tags[anchored].size(), 0);
  for (const SceneObservation& observation : observations.seen)
    seen[observation.tag] += observation.body == anchored ? 1 : 0;
  const auto most = static_cast<std::size_t>(std::ranges::max_element(seen) - seen.begin());
  problem.bundle.poses[problem.tags[anchored][most]].fixed = true;
  return {};
}

}  // namespace

Result<SceneBundle> scene_bundle(const TagScene& scene, const SceneRecording& recording,
                                 const SceneObservations& observations) {
  SceneBundle problem;
  add_poses(scene, recording.frames.size(), problem);
  problem.bundle.corners.reserve(observations.seen.size());
  for (const SceneObservation& seen : observations.seen) {
    problem.bundle.corners.push_back({problem.body_at(scene.cameras[seen.camera].body, seen.frame),
                                      problem.cameras[seen.camera], problem.body_at(seen.body, seen.frame),
                                      problem.tags[seen.body][seen.tag], seen.camera, seen.factor});
    problem.bundle.corners.back().size = problem.sizes[seen.body][seen.tag];
  }
  add_motion(scene, recording, problem);
  add_measurements(scene, problem);
  if (Status status = fix_one_body(scene, observations, problem); !status)
    return tl::unexpected(status.error());
  return problem;
}

void add_wiggle(const TagScene& scene, const SceneObservations& observations, SceneBundle& problem) {
  std::map<std::pair<std::size_t, std::size_t>, PoseIndex> own;  // for each frame and camera
  Bundle& bundle = problem.bundle;
  for (std::size_t i = 0; i < observations.seen.size(); ++i) {
    const SceneObservation& seen = observations.seen[i];
    const CameraOnBody& camera = scene.cameras[seen.camera];
    if (!(camera.wiggle_m > 0 && camera.wiggle_rad > 0)) continue;
    const PoseIndex mean = problem.cameras[seen.camera];
    auto [it, fresh] = own.try_emplace({seen.frame, seen.camera}, 0);
    if (fresh) {
      it->second = bundle.add(bundle.poses[mean].value);
      problem.moves.push_back(1);
      Vector6 sigma;
      sigma << Eigen::Vector3d::Constant(camera.wiggle_m), Eigen::Vector3d::Constant(camera.wiggle_rad);
      bundle.relatives.push_back({mean, it->second, {SE3(), {}, sigma.cwiseInverse().asDiagonal()}});
    }
    bundle.corners[i].cam = it->second;
  }
}

void add_planes(const TagScene& scene, SceneBundle& problem, std::vector<char>& placed) {
  constexpr double kFreeSigma = 1e3;  // [m, rad], for undetermined directions of a plane's pose
  Bundle& bundle = problem.bundle;
  for (const ScenePlane& plane : scene.planes) {
    std::vector<PoseIndex> tags;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      for (std::size_t t = 0; scene.bodies[b].is_static && t < scene.bodies[b].tags.size(); ++t) {
        const bool in_plane =
            std::ranges::find(plane.tags, scene.bodies[b].tags[t].id.number) != plane.tags.end();
        if (in_plane && placed[problem.tags[b][t]] != 0) tags.push_back(problem.tags[b][t]);
      }
    }
    if (tags.size() < 2) continue;
    const SE3 start = bundle.poses[tags.front()].value;
    const PoseIndex pose = bundle.add(start);
    problem.moves.push_back(0);
    placed.push_back(1);
    bundle.priors.push_back({pose, {start, Matrix6::Identity() / kFreeSigma}});
    for (PoseIndex tag : tags)
      bundle.on_floor.push_back(
          {pose, tag, {.height_sigma_m = plane.sigma_m, .tilt_sigma_rad = plane.sigma_rad}});
  }
}

}  // namespace waymark
