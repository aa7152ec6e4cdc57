#include "waymark/pipeline/lap_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

constexpr double kManyWithoutPose = 0.02;
constexpr std::array<std::string_view, 2> kMapMethods{"bundle", "chain"};

void warn_of_gaps(MappedLap& lap) {
  if (lap.frames_without_pose > kManyWithoutPose * lap.frames) {
    lap.warnings.push_back(
        fmt::format("{} of {} frames saw no tag that could be trusted", lap.frames_without_pose, lap.frames));
  }
  if (!lap.route.closed)
    lap.warnings.emplace_back("the lap does not come back to its start: the route is open, driven once");
}

std::vector<ObservedFrame> observe_all(const TaughtLap& taught, const TeachSetup& setup) {
  std::vector<ObservedFrame> observed;
  observed.reserve(taught.frames.size());
  for (const TagFrame& frame : taught.frames) observed.push_back(observe(frame, setup));
  return observed;
}

std::vector<ObservedFrame> observe_anchor(const TaughtLap& taught, const TeachSetup& setup) {
  std::vector<ObservedFrame> observed;
  for (TagFrame frame : taught.frames) {
    std::erase_if(frame.detections, [&](const TagDetection& seen) { return seen.tag != setup.anchor; });
    if (!frame.detections.empty()) observed.push_back(observe(frame, setup));
  }
  return observed;
}

/// Where the anchor was said to stand no observation of it agrees with a robot that drives on the floor.
tl::unexpected<Error> misplaced_anchor(const TagId& anchor) {
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("{}, the anchor, does not stand as its pose says: nothing the robot saw of it agrees",
                  to_string(anchor)),
      {},
      "An upright tag has roll -90, pitch 0 and its yaw (--anchor-pose 0 0 0.3 -90 0 -90); 0 0 0 lies on "
      "its back. Without --anchor-pose the lap tells how it stands.");
}

double tilt_between(const SE3& map_T_tag, const SE3& other) {
  const auto up = [](const SE3& T) { return Eigen::Vector3d(T.rotation().matrix().row(2).transpose()); };
  return std::acos(std::clamp(up(map_T_tag).dot(up(other)), -1.0, 1.0));
}

/// A pose that was given, turned about its centre by the smallest rotation that lets it lean as it does:
/// place and heading are the giver's, the floor's up is the map's z.
SE3 leaning_as(const SE3& stance, const SE3& given) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d floor_up = given.rotation() * (stance.rotation().inverse() * up);
  const SO3 level = SO3::from_quaternion(rotation_between(floor_up, up));
  return {level * given.rotation(), given.translation()};
}

/// The map is placed by how the anchor stands on the floor, in words if it is not upright; or a pose that was
/// given is held against it, and leans as the anchor does.
Result<std::string> place_anchor(const TaughtLap& taught, const MapLapOptions& options, TeachSetup& setup) {
  constexpr double kSurely = to_radians(60);  // a pose from few observations may be the mirrored one
  const auto stance =
      anchor_stance(observe_anchor(taught, setup), setup.anchor, setup.base_T_cam, options.chain.floor);
  if (!stance) return std::string();
  if (setup.anchor_pose_given) {
    if (tilt_between(setup.map_T_anchor, stance->map_T_anchor) > kSurely)
      return misplaced_anchor(setup.anchor);
    const bool of_older_map = options.prior && !options.prior->map.floor.covariance;
    if (!of_older_map) setup.map_T_anchor = leaning_as(stance->map_T_anchor, setup.map_T_anchor);
    return std::string();
  }
  setup.map_T_anchor = stance->map_T_anchor;
  return in_words(*stance, setup.anchor);
}

/// The floor of the chain: where the robot drove.
FloorPlane driven_floor(const Trajectory& trajectory) {
  std::vector<double> z_m;
  z_m.reserve(trajectory.size());
  for (const auto& pose : trajectory) z_m.push_back(pose.map_T_base.translation().z());
  return {.z_m = median(std::move(z_m))};
}

/// Seen from above: along the floor, also where the map that is extended leans.
Trajectory along_the_floor(const MappedLap& lap) {
  Trajectory trajectory = lap.trajectory;
  const SE3 floor_T_map = map_T_floor(lap.map.floor).inverse();
  for (StampedPose& pose : trajectory) pose.map_T_base = floor_T_map * pose.map_T_base;
  return trajectory;
}

/// A pose that was given for the anchor and how it leans in truth, where a person would see the difference.
std::string lean_in_words(const TeachSetup& given, const MappedTag& anchor) {
  constexpr double kWorthSaying = to_radians(1);
  const double lean = tilt_between(given.map_T_anchor, anchor.map_T_tag);
  if (!given.anchor_pose_given || lean < kWorthSaying) return {};
  return fmt::format(
      "the anchor {} leans by {:.1f} deg from the pose that was given: the map is level with "
      "the floor, the anchor's place and heading are as given",
      to_string(given.anchor), to_degrees(lean));
}

/// None of its observations was accepted in the end.
tl::unexpected<Error> lost_anchor(const TeachSetup& setup) {
  if (setup.anchor_pose_given) return misplaced_anchor(setup.anchor);
  return fail(ErrorCode::NotFound,
              fmt::format("{}, the anchor: nothing the robot saw of it agrees with the rest of the lap",
                          to_string(setup.anchor)),
              {},
              "Was it moved, or is its id on another tag too? Name a tag that is seen often: --anchor ID.");
}

/// From tag to tag, nothing optimised.
Result<MappedLap> by_chain(const TaughtLap& taught, const TeachSetup& setup, const MapLapOptions& options) {
  const std::vector<ObservedFrame> observed = observe_all(taught, setup);
  Result<ChainResult> chain =
      map_by_chain(observed, setup.anchor, setup.map_T_anchor, setup.sizes, setup.base_T_cam, options.chain);
  if (!chain) return tl::unexpected(chain.error());
  MappedLap lap{.map = std::move(chain->map),
                .trajectory = std::move(chain->trajectory),
                .frames_without_pose = chain->frames_without_pose};
  for (const ObservedFrame& frame : observed) {
    for (const TagPoseObservation& seen : frame.tags) {
      if (lap.map.find(seen.tag) != nullptr) ++lap.observations[seen.tag];
    }
  }
  for (const TagId& tag : chain->unconnected) {
    lap.warnings.push_back(
        fmt::format("{} was never seen together with a tag that leads to the anchor: it is not in the map",
                    to_string(tag)));
  }
  return lap;
}

/// Everything measured explained at once.
Result<MappedLap> by_bundle(const TaughtLap& taught, const TeachSetup& setup, const MapLapOptions& options,
                            const MapProgress& progress) {
  const LapInput input{.frames = taught.frames,
                       .odometry = taught.odometry,
                       .camera = setup.camera,
                       .base_T_cam = setup.base_T_cam,
                       .sizes = setup.sizes,
                       .anchor = setup.anchor,
                       .map_T_anchor = setup.map_T_anchor,
                       .imu = taught.imu,
                       .prior = options.prior,
                       .more_cameras = setup.more_cameras};
  Result<BundleMap> map = map_by_bundle(input, options.chain, options.bundle, progress);
  if (!map) return tl::unexpected(map.error());
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
                                           .correlated_frames = map->correlated_frames,
                                           .rejected = map->rejected.size(),
                                           .left_out = left_out_by_tag(input, *map),
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

}  // namespace

std::vector<std::string> map_methods() { return {kMapMethods.begin(), kMapMethods.end()}; }

std::string_view to_string(MapMethod method) { return kMapMethods[static_cast<std::size_t>(method)]; }

Result<MapMethod> parse_map_method(std::string_view name) {
  const auto* const found = std::ranges::find(kMapMethods, name);
  if (found != kMapMethods.end()) return static_cast<MapMethod>(found - kMapMethods.begin());
  return fail(ErrorCode::InvalidArgument, fmt::format("there is no method '{}'", name), {.key = "--method"},
              suggestion(std::string(name), map_methods()));
}

Result<MappedLap> map_lap(const TaughtLap& taught, const TeachSetup& given, const MapLapOptions& options,
                          const MapProgress& progress) {
  if (options.prior && options.method == MapMethod::Chain)
    return fail(ErrorCode::InvalidArgument, "the chain weighs nothing, so it cannot extend a map",
                {.key = "method"}, "Leave --method at bundle.");
  if (taught.frames.empty())
    return fail(ErrorCode::NotFound, "there is no frame of a camera in this lap", {},
                "Is this a recording of tags seen by a camera? `waymark info` shows its topics.");
  TeachSetup setup = given;
  const Result<std::string> stance = place_anchor(taught, options, setup);
  if (!stance) return tl::unexpected(stance.error());
  Result<MappedLap> lap = options.method == MapMethod::Chain ? by_chain(taught, setup, options)
                                                             : by_bundle(taught, setup, options, progress);
  if (!lap) return lap;
  if (lap->map.find(setup.anchor) == nullptr) return lost_anchor(setup);
  if (!stance->empty()) lap->warnings.push_back(*stance);
  if (const std::string words = lean_in_words(given, *lap->map.find(setup.anchor)); !words.empty())
    lap->warnings.push_back(words);
  if (options.method == MapMethod::Chain) lap->map.floor = driven_floor(lap->trajectory);
  Result<BuiltRoute> route = build_route(along_the_floor(*lap), options.route);
  if (!route) return tl::unexpected(route.error());
  lap->route_repeated_m = route->repeated_m;
  lap->route = std::move(*route);
  lap->frames = static_cast<int>(taught.frames.size());
  warn_of_gaps(*lap);
  return lap;
}

}  // namespace waymark
