#include "waymark/mapping/scene/rolling_corners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "waymark/factors/rolling_shutter.hpp"

namespace waymark {
namespace {

constexpr double kMaxGap_s = 0.2;  // over this time, hand motion is approximately a polynomial

/// Relative motions of cameras and tags.
class Motions {
 public:
  Motions(const SceneRecording& recording, const SceneMap& map) : recording_(recording), map_(map) {}

  [[nodiscard]] std::optional<SE3> cam_T_tag(const SceneObservation& seen, PoseIndex tag,
                                             std::size_t frame) const {
    const SceneBundle& problem = map_.problem;
    const PoseIndex rig = problem.body_at(map_.scene.cameras[seen.camera].body, frame);
    const PoseIndex body = problem.body_at(seen.body, frame);
    const PoseIndex cam = problem.cameras[seen.camera];
    for (PoseIndex pose : {rig, body, cam, tag})
      if (map_.placed[pose] == 0) return std::nullopt;
    const auto& poses = problem.bundle.poses;
    return (poses[rig].value * poses[cam].value).inverse() * poses[body].value * poses[tag].value;
  }

  /// The tag's motion around the time of a frame, which is a polynomial through its poses in up to two frames
  /// before and two after. Empty if there is no neighbouring frame.
  [[nodiscard]] std::optional<MovingTag> motion(const SceneObservation& seen, PoseIndex pose) const {
    const auto now = cam_T_tag(seen, pose, seen.frame);
    if (!now) return std::nullopt;
    constexpr Eigen::Index kMaxNeighbours = 4;
    Eigen::Matrix<double, kMaxNeighbours, 1> t;
    Eigen::Matrix<double, kMaxNeighbours, 6> moved;
    Eigen::Index count = 0;
    const auto take = [&](std::size_t frame) {
      const double apart_s = seconds(seen.frame, frame);
      if (std::abs(apart_s) > kMaxGap_s || apart_s == 0) return false;
      const auto then = cam_T_tag(seen, pose, frame);
      if (!then) return false;
      t[count] = apart_s;
      moved.row(count++) = (*then * now->inverse()).log().transpose();
      return true;
    };
    for (std::size_t k = 1; k <= 2 && k <= seen.frame && take(seen.frame - k);) ++k;
    for (std::size_t k = 1; k <= 2 && seen.frame + k < recording_.frames.size() && take(seen.frame + k);) ++k;
    if (count == 0) return std::nullopt;
    Eigen::MatrixXd powers(count, count);
    for (Eigen::Index row = 0; row < count; ++row)
      for (Eigen::Index power = 0; power < count; ++power)
        powers(row, power) = std::pow(t[row], static_cast<double>(power + 1));
    const Eigen::MatrixXd derivatives = powers.partialPivLu().solve(moved.topRows(count));
    MovingTag tag{.cam_T_tag = *now, .twist = derivatives.row(0).transpose()};
    if (count > 1) tag.bend = 2 * derivatives.row(1).transpose();
    return tag;
  }

 private:
  [[nodiscard]] double seconds(std::size_t from, std::size_t to) const {
    return to_seconds(recording_.frames[to].stamp - recording_.frames[from].stamp);
  }
  const SceneRecording& recording_;
  const SceneMap& map_;
};

/// Transforms the corners of one observation. Returns the largest change, which is infinite if the motion is
/// unknown.
double bring_to_middle(const SceneObservation& seen, double readout_s, const Motions& motions,
                       const CameraModel& camera, double side_m, CornerTerm& term) {
  std::optional<MovingTag> tag = motions.motion(seen, term.tag);
  if (tag) tag->size_m = side_m;
  const auto shift = tag ? rolling_shift(*tag, seen.factor.corners_px, camera, readout_s) : std::nullopt;
  if (!shift || !shift->allFinite()) return std::numeric_limits<double>::infinity();
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d middle =
        seen.factor.corners_px[i] - shift->segment<2>(static_cast<Eigen::Index>(2 * i));
    most = std::max(most, (middle - term.factor.corners_px[i]).norm());
    term.factor.corners_px[i] = middle;
  }
  return most;
}

}  // namespace

double bring_corners_to_middle(const SceneRecording& recording, SceneMap& map) {
  const Motions motions(recording, map);
  Bundle& bundle = map.problem.bundle;
  std::vector<PoseIndex> unknown;
  double most = 0;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    const double readout_s = map.scene.cameras[seen.camera].readout_s;
    CornerTerm& term = bundle.corners[i];
    if (readout_s == 0 || map.placed[term.tag] == 0) continue;
    const double change =
        bring_to_middle(seen, readout_s, motions, bundle.cameras[seen.camera], side_m(bundle, term), term);
    if (std::isfinite(change)) {
      most = std::max(most, change);
      continue;
    }
    term.used = false;
    for (PoseIndex pose : {term.rig, term.body})
      if (map.problem.moves[pose] != 0) unknown.push_back(pose);
  }
  for (PoseIndex pose : unknown) map.placed[pose] = 0;
  return most;
}

}  // namespace waymark
