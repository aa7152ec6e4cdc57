#include <fmt/format.h>

#include "waymark/app/map/map_steps.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"
#include "waymark/pipeline/pose_lap_mapper.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

/// Wheels turned by the gyro, where there is one: it knows turns better.
std::vector<Odometry> best_odometry(const RecordedLap& recorded) {
  const Trajectory gyro = gyro_odometry(recorded.odometry, recorded.imu);
  if (gyro.size() < 2) return recorded.odometry;
  std::vector<Odometry> odometry;
  for (const StampedPose& pose : gyro) odometry.push_back({pose.stamp, project_to_plane(pose.map_T_base)});
  return odometry;
}

}  // namespace

Result<MapFile> map_poses(const RecordedLap& recorded, const MapJob& job, MapReport& report) {
  if (job.overrides.anchor || job.overrides.map_T_anchor || job.extend)
    return fail(ErrorCode::Unsupported,
                "this recording holds poses of tags and no corners: its map stands where the lap began", {},
                "Leave out --anchor, --anchor-pose and --extend.");
  PoseLap lap{.frames = recorded.tag_poses, .odometry = best_odometry(recorded)};
  auto sizes = tag_sizes_of(recorded, job.overrides);
  if (!sizes) return tl::unexpected(sizes.error());
  lap.sizes = std::move(*sizes);
  if (Status status = lap.sizes.check(); !status) return tl::unexpected(status.error());
  if (const auto facts = recorded.setup.metadata.find(lap_facts::kMetadata);
      facts != recorded.setup.metadata.end() && facts->second.contains(lap_facts::kAnchor))
    report.warnings.push_back(
        fmt::format("the map stands where the lap began, not on the anchor {} that the recording names: it "
                    "holds poses of tags and no corners",
                    facts->second.at(lap_facts::kAnchor)));
  if (recorded.setup.base_T_cam) {
    lap.base_T_cam = *recorded.setup.base_T_cam;
  } else {
    lap.base_T_cam = SE3(body_R_optical(), Eigen::Vector3d::Zero());
    report.warnings.emplace_back(
        "nobody says where the camera sits: it starts above the middle of the base, looking ahead");
  }
  Result<MappedPoseLap> mapped = map_pose_lap(lap, {.points = job.points, .route = job.options.route});
  if (!mapped) return tl::unexpected(mapped.error());
  report.method = "poses";
  report.lap = std::move(mapped->lap);
  report.poses = mapped->figures;
  MapFile map = map_file_of(job, mapped->anchor, report.lap);
  map.provenance[0].second = report.method;
  return map;
}

void compare_with_prior(const MapJob& job, MapReport& report) {
  if (!job.prior) return;
  std::vector<PriorPoint> points;
  for (const Landmark& landmark : job.prior->landmarks.all())
    points.push_back({static_cast<int>(landmark.tag.number), landmark.map_T_tag.translation().head<2>()});
  const Result<MapComparison> comparison = job.prior->tags.tags.empty()
                                               ? compare_points(report.lap.map, points)
                                               : compare_maps(report.lap.map, job.prior->tags);
  if (!comparison) {
    report.warnings.push_back("prior map: " + to_string(comparison.error()));
    return;
  }
  report.prior_agreeing = comparison->agreeing;
  report.prior_rms_m = comparison->rms_m;
  for (const std::string& words : in_words(*comparison)) report.warnings.push_back(words);
}

}  // namespace waymark
