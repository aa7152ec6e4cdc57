#include "waymark/pipeline/lap_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/pipeline/lap_diagnosis.hpp"
#include "waymark/replay/route_checks.hpp"

namespace waymark {
namespace {

constexpr double kManyWithoutPose = 0.02;
constexpr std::array<std::string_view, 2> kMapMethods{"bundle", "chain"};

void warn_of_gaps(MappedLap& lap) {
  if (lap.frames_without_pose > kManyWithoutPose * lap.frames) {
    lap.warnings.push_back(
        fmt::format("{} of {} frames contain no reliable tag", lap.frames_without_pose, lap.frames));
  }
}

void warn_of_route(MappedLap& lap) {
  if (!lap.route.closed)
    lap.warnings.emplace_back("the lap does not return to its start; the route is open and driven once");
  if (const auto sideways = sideways_motion(lap.route)) lap.warnings.push_back(describe(*sideways));
}

std::vector<ObservedFrame> observe_all(const TaughtLap& taught, const TeachSetup& setup) {
  std::vector<ObservedFrame> observed;
  observed.reserve(taught.frames.size());
  for (const TagFrame& frame : taught.frames) observed.push_back(observe(frame, setup));
  return observed;
}

std::vector<ObservedFrame> observe_anchor(const TaughtLap& taught, const TeachSetup& setup) {
  std::vector<ObservedFrame> observed;
  for (const TagFrame& frame : taught.frames) {
    TagFrame of_anchor{.stamp = frame.stamp, .camera = frame.camera};
    for (const TagDetection& seen : frame.detections) {
      if (seen.tag == setup.anchor) of_anchor.detections.push_back(seen);
    }
    if (!of_anchor.detections.empty()) observed.push_back(observe(of_anchor, setup));
  }
  return observed;
}

/// The error if no observation of the anchor at its specified pose is consistent with a robot that drives on
/// the floor.
tl::unexpected<Error> misplaced_anchor(const TagId& anchor) {
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("the given pose of the anchor {} contradicts all of its observations", to_string(anchor)),
      {},
      "The pose of an upright tag has roll -90, pitch 0 and its yaw (`anchor_pose=0 0 0.3 -90 0 -90`); with "
      "0 0 0 the tag faces up. Without `anchor_pose` its orientation is estimated from the lap.");
}

double tilt_between(const SE3& map_T_tag, const SE3& other) {
  const auto up = [](const SE3& T) { return Eigen::Vector3d(T.rotation().matrix().row(2).transpose()); };
  return std::acos(std::clamp(up(map_T_tag).dot(up(other)), -1.0, 1.0));
}

/// The specified pose, rotated about its centre by the smallest rotation that results in the observed tilt.
/// Position and heading are unchanged, and the floor normal is the z axis of the map.
SE3 leaning_as(const SE3& stance, const SE3& given) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d floor_up = given.rotation() * (stance.rotation().inverse() * up);
  const SO3 level = SO3::from_quaternion(rotation_between(floor_up, up));
  return {level * given.rotation(), given.translation()};
}

/// Aligns the map with the pose of the anchor relative to the floor. Returns a message if the anchor is not
/// upright. A specified pose is compared with the observations and rotated to the observed tilt.
Result<std::string> place_anchor(const TaughtLap& taught, const MapLapOptions& options, TeachSetup& setup) {
  constexpr double kMaxTiltDifference =
      to_radians(60);  // a pose from only a few observations may be the mirrored one
  const auto stance =
      anchor_stance(observe_anchor(taught, setup), setup.anchor, setup.base_T_cam, options.chain.floor);
  if (!stance) return std::string();
  if (setup.anchor_pose_given) {
    if (tilt_between(setup.map_T_anchor, stance->map_T_anchor) > kMaxTiltDifference)
      return misplaced_anchor(setup.anchor);
    const bool of_older_map = options.prior && !options.prior->map.floor.covariance;
    if (!of_older_map) setup.map_T_anchor = leaning_as(stance->map_T_anchor, setup.map_T_anchor);
    return std::string();
  }
  setup.map_T_anchor = stance->map_T_anchor;
  return describe(*stance, setup.anchor);
}

/// The floor plane under the trajectory estimated by the chain.
FloorPlane driven_floor(const Trajectory& trajectory) {
  std::vector<double> z_m;
  z_m.reserve(trajectory.size());
  for (const auto& pose : trajectory) z_m.push_back(pose.map_T_base.translation().z());
  return {.z_m = median(std::move(z_m))};
}

/// The trajectory projected along the floor normal, even if the map to be extended is tilted.
Trajectory along_the_floor(const MappedLap& lap) {
  Trajectory trajectory = lap.trajectory;
  const SE3 floor_T_map = map_T_floor(lap.map.floor).inverse();
  for (StampedPose& pose : trajectory) pose.map_T_base = floor_T_map * pose.map_T_base;
  return trajectory;
}

/// A message about the difference between the specified and the observed tilt of the anchor, if it is large
/// enough to matter. Empty if the anchor was moved during the lap.
std::string describe_lean(const TeachSetup& given, const MappedLap& lap) {
  constexpr double kMinReportedTilt = to_radians(1);
  const bool moved = lap.bundle && std::ranges::find(lap.bundle->moved_tags, given.anchor, &MovedTag::tag) !=
                                       lap.bundle->moved_tags.end();
  const double lean = tilt_between(given.map_T_anchor, lap.map.find(given.anchor)->map_T_tag);
  if (moved || !given.anchor_pose_given || lean < kMinReportedTilt) return {};
  return fmt::format(
      "the anchor {} is tilted by {:.1f} deg relative to the given pose. The map is level with the floor; "
      "position and heading of the anchor are as given",
      to_string(given.anchor), to_degrees(lean));
}

/// The error if no observation of the anchor was accepted in the result.
tl::unexpected<Error> lost_anchor(const TeachSetup& setup) {
  if (setup.anchor_pose_given) return misplaced_anchor(setup.anchor);
  return fail(ErrorCode::NotFound,
              fmt::format("all observations of the anchor {} contradict the rest of the lap",
                          to_string(setup.anchor)),
              {},
              "Check that it was not moved and that its id is unique, or choose a tag that is observed often "
              "(`anchor=ID`).");
}

/// Fails if the map contains a single tag. Nothing but odometry then determines the route out of its view.
Status check_several_tags(const TagMap& map, const std::set<TagId>& observed) {
  if (map.tags.size() > 1) return {};
  if (observed.size() < 2)
    return fail(ErrorCode::NotFound, "the lap contains observations of a single tag, which is not a map", {},
                "Put up more tags, so that most images contain at least two, and record the lap again.");
  return fail(ErrorCode::NotFound,
              fmt::format("only one of {} observed tags can be mapped: no image contains two of them, and no "
                          "odometry connects them",
                          observed.size()),
              {},
              "Record the lap with odometry, or put up more tags, so that most images contain at least two.");
}

std::set<TagId> observed_tags(const std::vector<TagFrame>& frames) {
  std::set<TagId> tags;
  for (const TagFrame& frame : frames) {
    for (const TagDetection& seen : frame.detections) tags.insert(seen.tag);
  }
  return tags;
}

/// Maps by chaining from tag to tag, without optimisation.
Result<MappedLap> by_chain(const TaughtLap& taught, const TeachSetup& setup, const MapLapOptions& options) {
  std::vector<ObservedFrame> observed = observe_all(taught, setup);
  std::map<TagId, int> observations;
  for (const ObservedFrame& frame : observed) {
    for (const TagPoseObservation& seen : frame.tags) ++observations[seen.tag];
  }
  Result<ChainResult> chain = map_by_chain(std::move(observed), setup.anchor, setup.map_T_anchor, setup.sizes,
                                           setup.base_T_cam, options.chain);
  if (!chain) return tl::unexpected(chain.error());
  MappedLap lap{.map = std::move(chain->map),
                .trajectory = std::move(chain->trajectory),
                .frames_without_pose = chain->frames_without_pose};
  for (const auto& [tag, count] : observations) {
    if (lap.map.find(tag) != nullptr) lap.observations[tag] = count;
  }
  for (const TagId& tag : chain->unconnected) {
    lap.warnings.push_back(
        fmt::format("{} is not in the map: no frame contains it and a tag that is connected to the anchor",
                    to_string(tag)));
  }
  return lap;
}

/// Maps by bundle adjustment over all measurements. The input is the same afterwards, except for its sizes.
Result<MappedLap> adjusted(LapInput& input, const TeachSetup& setup, const MapLapOptions& options,
                           const MapProgress& progress) {
  Result<BundleMap> map = map_by_bundle_in_place(input, options.chain, options.bundle, progress);
  if (!map) return tl::unexpected(map.error());
  input.sizes = found_sizes(setup.sizes, *map);
  return MappedLap{.map = map->map,
                   .observations = map->observations,
                   .trajectory = map->trajectory,
                   .trajectory_covariance = map->trajectory_covariance,
                   .frames_without_pose = map->frames_without_pose,
                   .warnings = check_map(input, *map),
                   .bundle = BundleFigures{.start_map = map->start_map,
                                           .start_trajectory = map->start_trajectory,
                                           .iterations = map->summary.iterations,
                                           .rms_px = map->rms_px,
                                           .noise_ratio = map->noise_ratio,
                                           .wrong_sizes = map->wrong_sizes,
                                           .moved_tags = map->moved_tags,
                                           .missing_tags = map->missing_tags,
                                           .thin_cuts = map->thin_cuts,
                                           .size_spread = map->size_spread,
                                           .size_scale = map->size_scale,
                                           .size_scale_sigma = map->size_scale_sigma,
                                           .correlated_frames = map->correlated_frames,
                                           .rejected = map->rejected.size(),
                                           .left_out = rejections_by_tag(input, *map),
                                           .odometry_scales = map->odometry_scales,
                                           .odometry_scales_sigma = map->odometry_scales_sigma,
                                           .prior_agreeing = map->prior_agreeing,
                                           .moved_m = map->moved_m,
                                           .loop = loop_closure(input, *map),
                                           .mounting = map->mounting,
                                           .mounting_used = map->mounting_used,
                                           .turn_noise = map->turn_noise,
                                           .turns_by_gyro = map->turns_by_gyro,
                                           .without_gyro_share = map->without_gyro_share}};
}

Result<MappedLap> by_bundle(TaughtLap& taught, const TeachSetup& setup, const MapLapOptions& options,
                            const MapProgress& progress) {
  LapInput input{.frames = std::move(taught.frames),
                 .odometry = std::move(taught.odometry),
                 .camera = setup.camera,
                 .base_T_cam = setup.base_T_cam,
                 .sizes = setup.sizes,
                 .anchor = setup.anchor,
                 .map_T_anchor = setup.map_T_anchor,
                 .imu = std::move(taught.imu),
                 .prior = options.prior,
                 .more_cameras = setup.more_cameras};
  Result<MappedLap> lap = adjusted(input, setup, options, progress);
  taught = {std::move(input.frames), std::move(input.odometry), std::move(input.imu)};
  return lap;
}

}  // namespace

std::vector<std::string> map_methods() { return {kMapMethods.begin(), kMapMethods.end()}; }

std::string_view to_string(MapMethod method) { return kMapMethods[static_cast<std::size_t>(method)]; }

Result<MapMethod> parse_map_method(std::string_view name) {
  const auto* const found = std::ranges::find(kMapMethods, name);
  if (found != kMapMethods.end()) return static_cast<MapMethod>(found - kMapMethods.begin());
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown method '{}'", name), {.key = "method"},
              suggestion(std::string(name), map_methods()));
}

Result<MappedLap> map_lap(const TaughtLap& taught, const TeachSetup& setup, const MapLapOptions& options,
                          const MapProgress& progress) {
  TaughtLap lap = taught;
  return map_lap_in_place(lap, setup, options, progress);
}

namespace {

/// The odometry and the IMU data of a lap, corrected as long as this object exists.
class CorrectedLap {
 public:
  CorrectedLap(TaughtLap& taught, const SensorCorrection& correction)
      : taught_(taught), changed_(changes_lap(correction)) {
    if (!changed_) return;
    given_.odometry = taught.odometry;
    given_.imu = taught.imu;
    apply(correction, taught);
  }
  ~CorrectedLap() {
    if (!changed_) return;
    taught_.odometry = std::move(given_.odometry);
    taught_.imu = std::move(given_.imu);
  }
  CorrectedLap(const CorrectedLap&) = delete;
  CorrectedLap& operator=(const CorrectedLap&) = delete;

 private:
  TaughtLap& taught_;
  TaughtLap given_{};
  bool changed_;
};

/// Whether a map has the fault as one of its unknowns and reports its value.
bool is_unknown_of_map(SensorFault fault) {
  return fault == SensorFault::OdometryYawScale || fault == SensorFault::OdometryDistanceScale;
}

/// Adds the findings, with their messages before all others, because they may be the cause of those.
void add_sensors(const SensorDiagnosis& sensors, MappedLap& lap) {
  lap.sensors = sensors.findings;
  std::vector<std::string> messages;
  for (const SensorFinding& finding : sensors.findings) {
    if (!is_unknown_of_map(finding.found.likely.front().fault)) messages.push_back(describe(finding));
  }
  lap.warnings.insert(lap.warnings.begin(), messages.begin(), messages.end());
}

}  // namespace

Result<MappedLap> map_lap_in_place(TaughtLap& taught, const TeachSetup& given, const MapLapOptions& options,
                                   const MapProgress& progress) {
  if (options.prior && options.method == MapMethod::Chain)
    return fail(ErrorCode::InvalidArgument, "the method chain cannot extend a map", {.key = "method"},
                "Use the method bundle.");
  if (taught.frames.empty())
    return fail(ErrorCode::NotFound, "the lap contains no camera frame", {},
                "Check the topics of the recording with `waymark info`.");
  TeachSetup setup = given;
  const Result<std::string> stance = place_anchor(taught, options, setup);
  if (!stance) return tl::unexpected(stance.error());
  const SensorDiagnosis sensors = diagnose_lap(taught, setup);
  const CorrectedLap corrected(taught, sensors.correction);
  Result<MappedLap> lap = options.method == MapMethod::Chain ? by_chain(taught, setup, options)
                                                             : by_bundle(taught, setup, options, progress);
  if (!lap) return lap;
  if (lap->map.find(setup.anchor) == nullptr) return lost_anchor(setup);
  if (Status several = check_several_tags(lap->map, observed_tags(taught.frames)); !several)
    return tl::unexpected(several.error());
  if (!stance->empty()) lap->warnings.push_back(*stance);
  if (const std::string lean = describe_lean(given, *lap); !lean.empty()) lap->warnings.push_back(lean);
  if (options.method == MapMethod::Chain) lap->map.floor = driven_floor(lap->trajectory);
  Result<BuiltRoute> route = build_route(along_the_floor(*lap), options.route);
  if (!route) return tl::unexpected(route.error());
  lap->route_repeated_m = route->repeated_m;
  lap->route = std::move(*route);
  lap->frames = static_cast<int>(taught.frames.size());
  warn_of_gaps(*lap);
  warn_of_route(*lap);
  add_sensors(sensors, *lap);
  return lap;
}

namespace {

std::vector<PointFrame> as_points(const PoseLap& lap) {
  std::vector<PointFrame> frames;
  for (const TagPoseFrame& frame : lap.frames) {
    PointFrame points{.stamp = frame.stamp};
    for (const SeenTagPose& seen : frame.tags) {
      const Eigen::Vector3d base_p = lap.base_T_cam * seen.cam_T_tag.translation();
      points.points.push_back({seen.tag, base_p.head<2>()});
    }
    frames.push_back(std::move(points));
  }
  return frames;
}

/// The 3D poses of each tag, computed from the observations near its estimated position.
std::map<TagId, std::vector<SE3>> placed_observations(const PoseLap& lap, const LandmarkMap& points) {
  constexpr double kNear = 0.15;
  std::map<TagId, std::vector<SE3>> placed;
  for (std::size_t i = 0; i < points.frames.size(); ++i) {
    const SE3 map_T_cam = lift(points.map_X_base[i] * points.base_X_assumed) * lap.base_T_cam;
    for (const SeenTagPose& seen : lap.frames[points.frames[i]].tags) {
      const auto at = points.points.find(seen.tag);
      if (at == points.points.end()) continue;
      const SE3 map_T_tag = map_T_cam * seen.cam_T_tag;
      const bool near = (map_T_tag.translation().head<2>() - at->second.map_p).norm() < kNear;
      if (near) placed[seen.tag].push_back(map_T_tag);
    }
  }
  return placed;
}

struct Stance {
  SO3 map_R_tag{};
  double z_m = 0;
  double rotation_sigma_rad = 0.5;
  double z_sigma_m = 0.05;
};

/// The height is the median. For the orientation, the observation with the most others near it is averaged
/// with those. A square observed from the front has two possible poses, so the mean of all observations is
/// meaningless.
Stance stance_of(const std::vector<SE3>& observations) {
  constexpr double kAgree = 0.35;
  constexpr std::size_t kMaxCandidates = 200;
  std::vector<SE3> some;
  const std::size_t stride = observations.size() / kMaxCandidates + 1;
  for (std::size_t i = 0; i < observations.size(); i += stride) some.push_back(observations[i]);
  std::vector<double> z;
  Stance stance;
  std::ptrdiff_t most = 0;
  for (const SE3& candidate : some) {
    z.push_back(candidate.translation().z());
    const auto agreeing = std::ranges::count_if(some, [&](const SE3& other) {
      return (candidate.rotation().inverse() * other.rotation()).angle() < kAgree;
    });
    if (agreeing > most) stance.map_R_tag = candidate.rotation();
    most = std::max(most, agreeing);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const SE3& other : some) {
    const Eigen::Vector3d off = (other.rotation() * stance.map_R_tag.inverse()).log();
    if (off.norm() >= kAgree) continue;
    mean += off / static_cast<double>(most);
    squares += off.squaredNorm() / static_cast<double>(most);
  }
  stance.map_R_tag = SO3::exp(mean) * stance.map_R_tag;
  stance.z_m = median(std::move(z));
  // Uses the scatter instead of the standard error of the mean, because observations from the same drive
  // share their errors.
  stance.rotation_sigma_rad = std::max(0.02, std::sqrt(squares));
  return stance;
}

/// Tags in the centre of larger ones, which have the same position and fewer observations.
std::map<TagId, TagId> nested(const LandmarkMap& points) {
  constexpr double kSamePlace = 0.03;
  std::map<TagId, TagId> inner;
  for (const auto& [id, point] : points.points) {
    for (const auto& [other, outer] : points.points) {
      const bool same = !(id == other) && (point.map_p - outer.map_p).norm() < kSamePlace;
      if (same && std::pair(point.observations, other) < std::pair(outer.observations, id))
        inner.emplace(id, other);
    }
  }
  return inner;
}

Matrix6 tag_covariance(const SE3& map_T_tag, const MappedPoint& point, const Stance& stance) {
  Matrix6 P = Matrix6::Zero();
  P.topLeftCorner<2, 2>() = point.covariance;
  P(2, 2) = stance.z_sigma_m * stance.z_sigma_m;
  P.bottomRightCorner<3, 3>() =
      Eigen::Matrix3d::Identity() * (stance.rotation_sigma_rad * stance.rotation_sigma_rad);
  return from_coordinate_covariance(map_T_tag, P).covariance;
}

void warn_of_points(const LandmarkMap& points, const std::map<TagId, TagId>& inner,
                    std::vector<std::string>& words) {
  const auto names = [](const auto& ids) {
    std::vector<std::string> list;
    list.reserve(ids.size());
    for (const TagId& id : ids) list.push_back(to_string(id));
    return fmt::format("{}", fmt::join(list, ", "));
  };
  if (!points.rarely_observed.empty())
    words.push_back(names(points.rarely_observed) +
                    ": not in the map, too few observations while the robot moved");
  std::vector<TagId> inside;
  inside.reserve(inner.size());
  for (const auto& [id, outer] : inner) inside.push_back(id);
  if (!inside.empty())
    words.push_back(names(inside) + ": not in the map, nested in the middle of other tags");
  for (const auto& [id, point] : points.points) {
    if (point.rejected > point.observations)
      words.push_back(fmt::format(
          "{} of {} observations of {} contradict the others: the tag was moved, or another tag has "
          "the same id",
          point.rejected, point.rejected + point.observations, to_string(id)));
  }
  const SE2& m = points.base_X_assumed;
  constexpr double kMinReportedTilt_m = 0.01;
  if (m.translation().norm() > kMinReportedTilt_m)
    words.push_back(
        fmt::format("the camera mounting differs from the assumed one by {:.0f} mm forward, {:.0f} mm left "
                    "and {:.1f} deg "
                    "(+- {:.0f} mm, {:.0f} mm, {:.1f} deg); the map accounts for this",
                    1000 * m.x(), 1000 * m.y(), to_degrees(m.yaw()), 1000 * points.mounting_sigma.x(),
                    1000 * points.mounting_sigma.y(), to_degrees(points.mounting_sigma.z())));
}

void read_tags(const PoseLap& lap, const LandmarkMap& points, const std::map<TagId, TagId>& inner,
               MappedPoseLap& result) {
  constexpr double kUnknownSize_m = 0.1;
  double best = INFINITY;
  const auto placed = placed_observations(lap, points);
  for (const auto& [id, point] : points.points) {
    const auto observations = placed.find(id);
    if (inner.contains(id) || observations == placed.end()) continue;
    const Stance stance = stance_of(observations->second);
    const SE3 map_T_tag(stance.map_R_tag, {point.map_p.x(), point.map_p.y(), stance.z_m});
    result.lap.map.tags[id] = {map_T_tag, lap.sizes.size_m(id).value_or(kUnknownSize_m),
                               tag_covariance(map_T_tag, point, stance)};
    result.lap.observations[id] = point.observations;
    if (point.covariance.trace() < best) result.anchor = id;
    best = std::min(best, point.covariance.trace());
  }
}

}  // namespace

Result<MappedPoseLap> map_pose_lap(const PoseLap& lap, const MapPosesOptions& options) {
  const Result<LandmarkMap> points = map_landmarks(as_points(lap), lap.odometry, options.points);
  if (!points) return tl::unexpected(points.error());
  MappedPoseLap result;
  const std::map<TagId, TagId> inner = nested(*points);
  read_tags(lap, *points, inner, result);
  if (!lap.sizes.default_size_m)
    result.lap.warnings.emplace_back(
        "tag size unknown and not needed for poses; map.yaml contains 0.1 m (set `tag_size_m`)");
  warn_of_points(*points, inner, result.lap.warnings);
  for (std::size_t i = 0; i < points->frames.size(); ++i) {
    result.lap.trajectory.push_back({lap.frames[points->frames[i]].stamp, lift(points->map_X_base[i])});
    Matrix6 P = Matrix6::Zero();
    constexpr std::array<int, 3> kPlane = {0, 1, 5};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        P(kPlane[static_cast<std::size_t>(r)], kPlane[static_cast<std::size_t>(c)]) =
            points->base_covariance[i](r, c);
    }
    result.lap.trajectory_covariance.push_back(P);
  }
  Result<BuiltRoute> route = build_route(result.lap.trajectory, options.route);
  if (!route) return tl::unexpected(route.error());
  result.lap.route_repeated_m = route->repeated_m;
  result.lap.route = std::move(*route);
  result.lap.frames = static_cast<int>(points->frames.size());
  warn_of_route(result.lap);
  result.figures = {points->scales, points->scales_sigma, points->base_X_assumed, points->mounting_sigma,
                    points->rms_m};
  return result;
}

}  // namespace waymark
