#include "waymark/mapping/lap/chain.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using internal::Alternative;
using internal::FloorFrame;
using internal::Places;
using internal::TagShapes;
using internal::Vote;

// 0.999 quantiles of chi-square, named after the degrees of freedom.
constexpr double kGate3 = 16.3;  // a planar motion
constexpr double kGate6 = 22.5;  // one shape and a planar motion
constexpr double kGate9 = 27.9;  // two shapes and a planar motion

Eigen::Matrix3d noise_of_places(const ChainOptions& options) {
  const Eigen::Vector3d sigmas(options.map_sigma_m, options.map_sigma_m, options.map_sigma_rad);
  return sigmas.cwiseAbs2().asDiagonal();
}

struct PlacedFrame {
  SensorTime stamp{};
  std::vector<Vote<SE2>> votes{};
  SE2 map_X_base{};
};

/// Base pose according to the frames just before and after: medians over the same number of frames on both
/// sides. A robot does not jump for the duration of a single frame.
Alternative<SE2> among_neighbours(const std::vector<PlacedFrame>& frames, std::size_t i) {
  constexpr std::size_t kMaxNeighbours = 7;
  constexpr double kWindowSeconds = 0.6;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> turned;
  std::size_t first = i - std::min(i, kMaxNeighbours);
  std::size_t last = std::min(i + kMaxNeighbours, frames.size() - 1);
  const std::size_t reach = std::min(i - first, last - i);
  const bool at_an_end = reach < kMaxNeighbours / 2;
  if (!at_an_end) {
    first = i - reach;
    last = i + reach;
  }
  for (std::size_t k = first; k <= last; ++k) {
    if (std::abs(to_seconds(frames[k].stamp - frames[i].stamp)) > kWindowSeconds) continue;
    x.push_back(frames[k].map_X_base.x());
    y.push_back(frames[k].map_X_base.y());
    turned.push_back((frames[i].map_X_base.rotation().inverse() * frames[k].map_X_base.rotation()).angle());
  }
  const SE2 middle(median(x), median(y), frames[i].map_X_base.yaw() + median(turned));
  const double sigma_m = at_an_end ? 0.15 : 0.05;  // at an end, all neighbours are on one side
  const Eigen::Matrix3d scatter = Eigen::Vector3d(1, 1, 4).asDiagonal() * (sigma_m * sigma_m);
  return {middle, from_coordinate_covariance(middle, scatter).covariance.inverse()};
}

Trajectory trajectory_of(const std::vector<FloorFrame>& frames, const Places& places,
                         const ChainOptions& options, const SE3& map_T_floor) {
  std::vector<PlacedFrame> placed;
  const Eigen::Matrix3d noise = noise_of_places(options);
  for (const FloorFrame& frame : frames) {
    PlacedFrame here{frame.stamp, internal::votes_for_base(frame, places, noise)};
    const auto agreed = internal::agree(here.votes, kGate6);
    if (!agreed) continue;
    here.map_X_base = agreed->value.mean;
    placed.push_back(std::move(here));
  }
  Trajectory trajectory;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Alternative<SE2> middle = among_neighbours(placed, i);
    // Jumps are caused by tags for which the wrong one of two poses was selected. These tags vote again, near
    // the pose given by the neighbours.
    const bool jumps = internal::distance2(middle, placed[i].map_X_base) > kGate3;
    placed[i].votes.push_back({middle});
    const auto agreed =
        internal::agree_near(placed[i].votes, jumps ? middle.value : placed[i].map_X_base, kGate6);
    trajectory.push_back({placed[i].stamp, map_T_floor * lift(agreed ? agreed->value.mean : middle.value)});
  }
  return trajectory;
}

void erase_distant_tags(double max_distance_m, std::vector<ObservedFrame>& frames) {
  for (ObservedFrame& frame : frames) {
    std::erase_if(frame.tags, [&](const TagPoseObservation& seen) {
      return seen.cam_T_tag.translation().norm() > max_distance_m;
    });
  }
}

}  // namespace

ObservedFrame observe(const TagFrame& frame, const CameraModel& camera, const TagSizes& sizes) {
  ObservedFrame observed{.stamp = frame.stamp};
  observed.tags.reserve(frame.detections.size());
  for (const TagDetection& detection : frame.detections) {
    const Result<TagPose> pose = estimate_tag_pose(detection, sizes, camera);
    if (!pose) continue;
    observed.tags.push_back({detection.tag, pose->best.cam_T_tag, pose->ambiguity_ratio(),
                             pose->best.covariance, pose->best.chi2, pose->other});
  }
  return observed;
}

Result<ChainResult> map_by_chain(std::vector<ObservedFrame> frames, const TagId& anchor,
                                 const SE3& map_T_anchor, const TagSizes& sizes, const SE3& base_T_cam,
                                 const ChainOptions& options, const std::vector<Odometry>& wheels) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  std::set<TagId> seen;
  for (const ObservedFrame& frame : frames) {
    for (const auto& tag : frame.tags) seen.insert(tag.tag);
  }
  erase_distant_tags(options.max_distance_m, frames);
  const TagShapes shapes = internal::tag_shapes(frames, base_T_cam, options.floor);
  if (!shapes.contains(anchor) && seen.contains(anchor)) {
    return fail(ErrorCode::NotFound,
                fmt::format("the anchor {} is observed in this lap, but never within {} m", to_string(anchor),
                            options.max_distance_m),
                {}, "Check the tag size, or raise `max_distance_m`.");
  }
  if (!shapes.contains(anchor)) {
    return fail(ErrorCode::NotFound,
                fmt::format("the anchor {} is not observed in this lap", to_string(anchor)), {},
                "Start and end the lap where the anchor is in view, or choose another with `anchor`.");
  }
  const auto on_floor = internal::floor_frames(frames, shapes, base_T_cam, options.floor);
  frames = std::vector<ObservedFrame>();  // far larger than the frames on the floor
  const SE3& anchor_shape = shapes.at(anchor);
  const SE3 map_T_floor({}, {0, 0, map_T_anchor.translation().z() - anchor_shape.translation().z()});
  const SE2 map_X_anchor = project_to_plane(map_T_anchor * anchor_shape.inverse());
  const internal::Links links = internal::links_of(on_floor);
  Places places = internal::compose_from_anchor(links, anchor, map_X_anchor);
  if (options.spread_closing_error) internal::spread_closing_error(links, anchor, places);
  if (!wheels.empty())
    internal::place_islands(on_floor, links, OdometryTrack(wheels), noise_of_places(options),
                            options.spread_closing_error, places);
  ChainResult result;
  for (const TagId& tag : seen) {
    const auto place = places.find(tag);
    const Result<double> size = sizes.size_m(tag);
    if (place == places.end() || !size) {
      result.unconnected.push_back(tag);
      continue;
    }
    const SE3 map_T_tag =
        tag == anchor ? map_T_anchor : map_T_floor * lift(place->second.mean) * shapes.at(tag);
    result.map.tags[tag] = {.map_T_tag = map_T_tag, .size_m = *size};
  }
  result.trajectory = trajectory_of(on_floor, places, options, map_T_floor);
  result.frames_without_pose = static_cast<int>(on_floor.size() - result.trajectory.size());
  return result;
}

}  // namespace waymark

namespace waymark::internal {
namespace {

constexpr double kAnyDistance = 1e6;

Vote<SE2> between_tags(const FloorObservation& from, const FloorObservation& to) {
  Vote<SE2> vote;
  for (const FloorFit& base_X_from : from.base_X_tag) {
    for (const FloorFit& base_X_to : to.base_X_tag) {
      const Uncertain<SE2> from_X_to = between(base_X_from.a_X_b, base_X_to.a_X_b);
      vote.push_back({from_X_to.mean, from_X_to.covariance.inverse(), base_X_from.chi2 + base_X_to.chi2});
    }
  }
  return vote;
}

double position_variance(const Uncertain<SE2>& map_X_tag) {
  return coordinate_covariance(map_X_tag).topLeftCorner<2, 2>().trace();
}

/// A link to a tag, as the motion from the other tag to this one.
struct Neighbour {
  TagId other{};
  Uncertain<SE2> other_X_tag{};
  int votes = 0;
};
using Neighbours = std::map<TagId, std::vector<Neighbour>>;

Neighbours neighbours_of(const Links& links) {
  Neighbours neighbours;
  for (const auto& [pair, link] : links) {
    neighbours[pair.second].push_back({pair.first, link.from_X_to, link.votes});
    neighbours[pair.first].push_back({pair.second, inverse(link.from_X_to), link.votes});
  }
  return neighbours;
}

/// The pose of a tag according to all placed tags that were observed together with it.
std::optional<Uncertain<SE2>> place_of(const std::vector<Neighbour>& neighbours, const Places& places,
                                       int min_votes) {
  std::vector<Vote<SE2>> votes;
  for (const Neighbour& neighbour : neighbours) {
    const auto known = places.find(neighbour.other);
    if (neighbour.votes < min_votes || known == places.end()) continue;
    const Uncertain<SE2> map_X_tag = compose(known->second, neighbour.other_X_tag);
    votes.push_back({{map_X_tag.mean, map_X_tag.covariance.inverse()}});
  }
  const auto agreed = agree(votes, kAnyDistance);
  return agreed ? std::optional(agreed->value) : std::nullopt;
}

/// A tag that has not been placed yet, with its pose according to links with at least kMinVotes votes.
struct Waiting {
  std::array<std::optional<Uncertain<SE2>>, 3> place{};
  std::array<double, 3> variance{};
};
constexpr std::array<int, 3> kMinVotes = {10, 3, 1};

void update_waiting(const std::vector<Neighbour>& neighbours, const Places& places, Waiting& waiting) {
  for (std::size_t i = 0; i < kMinVotes.size(); ++i) {
    waiting.place[i] = place_of(neighbours, places, kMinVotes[i]);
    if (waiting.place[i]) waiting.variance[i] = position_variance(*waiting.place[i]);
  }
}

/// The waiting tag with the smallest uncertainty, using only the links with the most votes if there are any.
std::optional<std::pair<TagId, Uncertain<SE2>>> most_certain(const std::map<TagId, Waiting>& all) {
  for (std::size_t i = 0; i < kMinVotes.size(); ++i) {
    const std::pair<const TagId, Waiting>* best = nullptr;
    for (const auto& entry : all) {
      const Waiting& waiting = entry.second;
      if (waiting.place[i] && (best == nullptr || waiting.variance[i] < best->second.variance[i]))
        best = &entry;
    }
    if (best != nullptr) return std::pair(best->first, *best->second.place[i]);
  }
  return std::nullopt;
}

}  // namespace

std::vector<Vote<SE2>> votes_for_base(const FloorFrame& frame, const Places& places,
                                      const Eigen::Matrix3d& noise) {
  std::vector<Vote<SE2>> votes;
  for (const FloorObservation& seen : frame.tags) {
    const auto place = places.find(seen.tag);
    if (place == places.end()) continue;
    Vote<SE2> vote;
    for (const FloorFit& base_X_tag : seen.base_X_tag) {
      Uncertain<SE2> tag_X_base = inverse(base_X_tag.a_X_b);
      tag_X_base.covariance += noise;
      const Uncertain<SE2> map_X_base = compose(Uncertain<SE2>{place->second.mean}, tag_X_base);
      vote.push_back({map_X_base.mean, map_X_base.covariance.inverse(), base_X_tag.chi2});
    }
    votes.push_back(std::move(vote));
  }
  return votes;
}

Links links_of(const std::vector<FloorFrame>& frames) {
  std::map<std::pair<TagId, TagId>, std::vector<Vote<SE2>>> votes;
  for (const FloorFrame& frame : frames) {
    for (const FloorObservation& from : frame.tags) {
      for (const FloorObservation& to : frame.tags) {
        if (from.tag < to.tag) votes[{from.tag, to.tag}].push_back(between_tags(from, to));
      }
    }
  }
  Links links;
  for (const auto& [pair, of_pair] : votes) {
    if (const auto agreed = agree(of_pair, kGate9)) links[pair] = {agreed->value, agreed->votes};
  }
  return links;
}

Places compose_from_anchor(const Links& links, const TagId& anchor, const SE2& map_X_anchor) {
  const Neighbours neighbours = neighbours_of(links);
  std::map<TagId, Waiting> waiting;  // tags observed together with a placed tag
  Places places = {{anchor, {map_X_anchor}}};
  // The uncertainty can have decreased only for tags that were observed together with the last placed tag.
  const auto placed = [&](const TagId& tag) {
    const auto of_tag = neighbours.find(tag);
    if (of_tag == neighbours.end()) return;
    for (const Neighbour& neighbour : of_tag->second) {
      if (places.contains(neighbour.other)) continue;
      update_waiting(neighbours.at(neighbour.other), places, waiting[neighbour.other]);
    }
  };
  placed(anchor);
  while (const auto best = most_certain(waiting)) {
    places.insert(*best);
    waiting.erase(best->first);
    placed(best->first);
  }
  return places;
}

void spread_closing_error(const Links& links, const TagId& anchor, Places& places) {
  constexpr int kIterations = 20;
  std::map<TagId, Eigen::Index> column;
  for (const auto& [tag, place] : places) {
    if (tag != anchor) column.emplace(tag, 3 * static_cast<Eigen::Index>(column.size()));
  }
  const auto size = 3 * static_cast<Eigen::Index>(column.size());
  if (size == 0) return;
  for (int i = 0; i < kIterations; ++i) {
    std::vector<Eigen::Triplet<double>> H;
    const auto add = [&](Eigen::Index row, Eigen::Index col, const Eigen::Matrix3d& block) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c)
          H.emplace_back(static_cast<int>(row) + r, static_cast<int>(col) + c, block(r, c));
      }
    };
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    for (const auto& [pair, link] : links) {
      const auto from = places.find(pair.first);
      const auto to = places.find(pair.second);
      if (from == places.end() || to == places.end()) continue;
      const SE2 from_X_map = from->second.mean.inverse();
      const SE2::Tangent r = minus(link.from_X_to.mean, from_X_map * to->second.mean);
      const Eigen::Matrix3d W = link.from_X_to.covariance.inverse();
      const Eigen::Matrix3d Ad = from_X_map.adjoint();
      const double weight = 1 / (1 + r.dot(W * r) / 9);
      const Eigen::Matrix3d JWJ = weight * Ad.transpose() * W * Ad;
      const Eigen::Vector3d JWr = weight * Ad.transpose() * W * r;
      const auto a = column.find(pair.first);
      const auto b = column.find(pair.second);
      if (a != column.end()) {
        add(a->second, a->second, JWJ);
        g.segment<3>(a->second) -= JWr;
      }
      if (b != column.end()) {
        add(b->second, b->second, JWJ);
        g.segment<3>(b->second) += JWr;
      }
      if (a != column.end() && b != column.end()) {
        add(a->second, b->second, -JWJ);
        add(b->second, a->second, -JWJ);
      }
    }
    Eigen::SparseMatrix<double> sparse(size, size);
    sparse.setFromTriplets(H.begin(), H.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(sparse);
    const Eigen::VectorXd step = ldlt.solve(g);
    if (ldlt.info() != Eigen::Success || !step.allFinite()) return;
    for (const auto& [tag, at] : column) {
      SE2& map_X_tag = places.at(tag).mean;
      map_X_tag = plus(SE2::Tangent(step.segment<3>(at)), map_X_tag);
    }
    if (step.squaredNorm() < 1e-20) return;
  }
}

namespace {

/// A group of tags that are connected by links.
struct Island {
  Links links{};
  std::map<TagId, int> seen{};        ///< number of frames for each tag
  std::vector<std::size_t> frames{};  ///< frames with at least one of the tags
};

class Islands {
 public:
  Islands(const std::vector<FloorFrame>& frames, const Links& links, const Places& places) {
    for (const auto& [pair, link] : links) above_[root(pair.first)] = root(pair.second);
    for (std::size_t f = 0; f < frames.size(); ++f) {
      for (const FloorObservation& observation : frames[f].tags) {
        if (places.contains(observation.tag)) continue;
        Island& island = islands_[root(observation.tag)];
        ++island.seen[observation.tag];
        if (island.frames.empty() || island.frames.back() != f) island.frames.push_back(f);
      }
    }
    for (const auto& [pair, link] : links) {
      const auto island = islands_.find(root(pair.first));
      if (island != islands_.end()) island->second.links.emplace(pair, link);
    }
  }

  /// Removes and returns the island of a tag; empty if its tags have already been placed.
  std::optional<Island> take(const TagId& tag) {
    auto node = islands_.extract(root(tag));
    return node.empty() ? std::nullopt : std::optional(std::move(node.mapped()));
  }

 private:
  TagId root(TagId tag) {
    while (true) {
      const TagId next = above_.try_emplace(tag, tag).first->second;
      if (next == tag) return tag;
      tag = above_[tag] = above_.try_emplace(next, next).first->second;
    }
  }

  std::map<TagId, TagId> above_{};
  std::map<TagId, Island> islands_{};
};

class IslandPlacer {
 public:
  IslandPlacer(const std::vector<FloorFrame>& frames, const OdometryTrack& wheels,
               const Eigen::Matrix3d& noise, bool spread, Places& places)
      : frames_(frames), noise_(noise), spread_(spread), places_(places), map_X_base_(frames.size()) {
    for (const FloorFrame& frame : frames) odom_X_base_.push_back(wheels.at(frame.stamp));
    for (std::size_t f = 0; f < frames.size(); ++f) map_X_base_[f] = base_by(places, f);
  }

  /// Visits the frames in this order, and places each of them relative to the last placed frame.
  void run(const std::vector<std::size_t>& order, Islands& islands) {
    std::optional<std::size_t> last;
    for (const std::size_t f : order) {
      for (std::size_t t = 0; last && !map_X_base_[f] && t < frames_[f].tags.size(); ++t) {
        const TagId& tag = frames_[f].tags[t].tag;
        if (places_.contains(tag)) continue;
        if (const auto island = islands.take(tag)) place(*island, *last);
      }
      if (map_X_base_[f] && odom_X_base_[f]) last = f;
    }
  }

 private:
  [[nodiscard]] std::optional<SE2> base_by(const Places& places, std::size_t frame) const {
    const auto agreed = agree(votes_for_base(frames_[frame], places, noise_), kGate6);
    return agreed ? std::optional(agreed->value.mean) : std::nullopt;
  }

  /// Places an island using odometry from a placed frame.
  void place(const Island& island, std::size_t from) {
    const auto most = std::ranges::max_element(island.seen, {}, [](const auto& seen) { return seen.second; });
    Places here = compose_from_anchor(island.links, most->first, SE2());
    if (spread_) spread_closing_error(island.links, most->first, here);
    const std::optional<SE2> map_X_island = carried(island, here, from);
    if (!map_X_island) return;
    for (auto& [tag, place] : here) {
      place.mean = *map_X_island * place.mean;
      places_.insert_or_assign(tag, place);
    }
    for (const std::size_t f : island.frames) {
      if (!map_X_base_[f]) map_X_base_[f] = base_by(places_, f);
    }
  }

  /// The pose of the island that the nearest of its frames agree on.
  [[nodiscard]] std::optional<SE2> carried(const Island& island, const Places& here, std::size_t from) const {
    constexpr std::size_t kFrames = 15;
    constexpr int kMinVotingFrames = 4;
    std::vector<std::size_t> nearest = island.frames;
    const auto away = [&](std::size_t f) { return f > from ? f - from : from - f; };
    std::ranges::stable_sort(nearest, {}, away);
    std::vector<Vote<SE2>> votes;
    for (const std::size_t f : nearest) {
      if (votes.size() == kFrames) break;
      if (!odom_X_base_[f]) continue;
      const std::optional<SE2> island_X_base = base_by(here, f);
      if (!island_X_base) continue;
      const SE2 map_X_base = *map_X_base_[from] * (odom_X_base_[from]->inverse() * *odom_X_base_[f]);
      const SE2 map_X_island = map_X_base * island_X_base->inverse();
      votes.push_back({{map_X_island, information_about(map_X_base), 0}});
    }
    const auto agreed = agree(votes, kGate3);
    if (!agreed || agreed->votes < std::max(kMinVotingFrames, static_cast<int>(votes.size()) / 2))
      return std::nullopt;
    return agreed->value.mean;
  }

  /// Information of a motion that starts at an uncertain base pose.
  static Eigen::Matrix3d information_about(const SE2& map_X_base) {
    constexpr double kSigma_m = 0.05;
    constexpr double kSigma_rad = 0.05;
    const Eigen::Vector3d sigma(kSigma_m, kSigma_m, kSigma_rad);
    const Eigen::Matrix3d whitened = sigma.cwiseInverse().asDiagonal() * map_X_base.inverse().adjoint();
    return whitened.transpose() * whitened;
  }

  const std::vector<FloorFrame>& frames_;
  const Eigen::Matrix3d& noise_;
  bool spread_;
  Places& places_;
  std::vector<std::optional<SE2>> map_X_base_;
  std::vector<std::optional<SE2>> odom_X_base_{};
};

}  // namespace

void place_islands(const std::vector<FloorFrame>& frames, const Links& links, const OdometryTrack& wheels,
                   const Eigen::Matrix3d& noise, bool spread_closing_errors, Places& places) {
  Islands islands(frames, links, places);
  IslandPlacer carrier(frames, wheels, noise, spread_closing_errors, places);
  std::vector<std::size_t> order(frames.size());
  for (std::size_t f = 0; f < order.size(); ++f) order[f] = f;
  carrier.run(order, islands);
  std::ranges::reverse(order);
  carrier.run(order, islands);
}

}  // namespace waymark::internal
