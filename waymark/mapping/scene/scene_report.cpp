#include "waymark/mapping/scene/scene_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/scene/missing_scene_tags.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/odometry_checks.hpp"
#include "waymark/mapping/scene/pixel_shift.hpp"
#include "waymark/mapping/scene/prior_checks.hpp"
#include "waymark/mapping/scene/scene_calibration.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"
#include "waymark/mapping/solver/thin_cuts.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

void list_rejected(const SceneRecording& recording, SceneMap& map) {
  std::vector<double> chi2 = corner_chi2(map.problem.bundle);
  for (double& x : chi2) x *= map.correlated_frames;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    const CornerTerm& term = map.problem.bundle.corners[i];
    const bool placed = map.placed[term.rig] != 0 && map.placed[term.cam] != 0 &&
                        map.placed[term.body] != 0 && map.placed[term.tag] != 0;
    if (!term.used && placed)
      map.rejected.push_back(
          {recording.frames[seen.frame].stamp, map.scene.bodies[seen.body].tags[seen.tag].id, chi2[i]});
  }
}

/// Removes from the map all tags that have no observation in use.
void remove_contradicted_tags(SceneMap& map) {
  std::vector<char> seen(map.problem.bundle.poses.size(), 0);
  std::vector<char> used(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    seen[term.tag] = 1;
    if (term.used) used[term.tag] = 1;
  }
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex pose = map.problem.tags[b][t];
      if (seen[pose] == 0 || used[pose] != 0 || map.placed[pose] == 0 || map.problem.bundle.poses[pose].fixed)
        continue;
      if (map.scene.bodies[b].tags[t].body_T_tag) continue;  // a tag with a prior keeps its pose
      map.placed[pose] = 0;
      map.rejected_tags.push_back(map.scene.bodies[b].tags[t].id);
    }
  }
}

/// The observations, including unconfirmed ones, that connect unplaced tags to those in the map.
TagCut cut_of(const SceneMap& map, const std::vector<TagId>& group) {
  TagCut cut{.beyond = group};
  std::set<std::size_t> reached;
  for (const SceneObservation& seen : map.observations.seen) {
    if (std::ranges::binary_search(group, map.scene.bodies[seen.body].tags[seen.tag].id))
      reached.insert(seen.frame);
  }
  std::set<TagId> by;
  for (const SceneObservation& seen : map.observations.seen) {
    if (!reached.contains(seen.frame) || map.placed[map.problem.tags[seen.body][seen.tag]] == 0) continue;
    by.insert(map.scene.bodies[seen.body].tags[seen.tag].id);
    ++cut.observations;
  }
  cut.by.assign(by.begin(), by.end());
  return cut;
}

/// Groups unplaced tags that share a frame.
void list_unconnected(SceneMap& map) {
  std::map<TagId, std::set<std::size_t>> frames;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    if (map.problem.bundle.corners[i].unconfirmed &&
        frames.contains(map.scene.bodies[seen.body].tags[seen.tag].id))
      continue;
    const TagId id = map.scene.bodies[seen.body].tags[seen.tag].id;
    const bool rejected = std::ranges::find(map.rejected_tags, id) != map.rejected_tags.end();
    if (map.placed[map.problem.tags[seen.body][seen.tag]] == 0 && !rejected) frames[id].insert(seen.frame);
  }
  while (!frames.empty()) {
    std::vector<TagId> group = {frames.begin()->first};
    std::set<std::size_t> reached = std::move(frames.begin()->second);
    frames.erase(frames.begin());
    for (bool grew = true; grew;) {
      grew = false;
      for (auto it = frames.begin(); it != frames.end();) {
        const bool meets =
            std::ranges::any_of(it->second, [&](std::size_t f) { return reached.contains(f); });
        if (!meets) {
          ++it;
          continue;
        }
        group.push_back(it->first);
        reached.insert(it->second.begin(), it->second.end());
        it = frames.erase(it);
        grew = true;
      }
    }
    std::ranges::sort(group);
    if (TagCut cut = cut_of(map, group); cut.observations > 0) map.left_out_cuts.push_back(std::move(cut));
    map.unconnected.push_back(std::move(group));
  }
}

}  // namespace

void measure_reprojection(SceneMap& map) {
  std::vector<double> errors;
  const Bundle& bundle = map.problem.bundle;
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    const auto r = corner_residual(plain, bundle.cameras[term.camera], poses_of(bundle, term));
    for (Eigen::Index k = 0; r && k < 4; ++k) errors.push_back(r->segment<2>(2 * k).norm());
  }
  if (errors.empty()) return;
  map.reprojection_mean_px =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  map.reprojection_median_px = median(std::move(errors));
}

namespace {

/// Whether a pose is given about as precisely as the map has it, so that nothing else determines it better.
bool is_given_precisely(const SceneMap& map, PoseIndex pose, const std::optional<ScenePrior>& prior) {
  constexpr double kMaxVarianceRatio = 2;
  if (map.problem.bundle.poses[pose].fixed) return true;
  return prior && prior->covariance().topLeftCorner<3, 3>().trace() <=
                      kMaxVarianceRatio * map.covariance.poses[pose].topLeftCorner<3, 3>().trace();
}

/// The tags that define the map frame: those with a known pose or, if there are none, the one with the most
/// observations. A pose that the observations determine much better than its prior is not known.
std::set<PoseIndex> roots_of(const SceneMap& map) {
  std::vector<int> used(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) used[term.tag] += term.used ? 1 : 0;
  std::set<PoseIndex> roots;
  std::optional<PoseIndex> most;
  std::optional<PoseIndex> most_given;
  const auto keep_more = [&](PoseIndex tag, std::optional<PoseIndex>& best) {
    if (used[tag] > 0 && (!best || used[tag] > used[*best])) best = tag;
  };
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const SceneTag& tag = map.scene.bodies[b].tags[t];
      const PoseIndex pose = map.problem.tags[b][t];
      const MovedTag* moved = find_moved(map, tag.id);
      const PoseIndex given = moved != nullptr ? *moved->earlier : pose;
      if (used[given] > 0 && is_given_precisely(map, given, tag.body_T_tag)) roots.insert(given);
      if (tag.body_T_tag) keep_more(given, most_given);
      keep_more(pose, most);
    }
  }
  if (roots.empty() && most_given) roots.insert(*most_given);
  if (roots.empty() && most) roots.insert(*most);
  return roots;
}

void list_thin_cuts(SceneMap& map) {
  std::map<PoseIndex, TagId> ids;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t)
      ids[map.problem.tags[b][t]] = map.scene.bodies[b].tags[t].id;
  }
  for (PoseIndex pose : map.covariance.undetermined) {
    if (ids.contains(pose) && map.placed[pose] != 0) map.undetermined.push_back(ids.at(pose));
  }
  std::ranges::sort(map.undetermined);
  const auto named = [&](const std::vector<PoseIndex>& tags) {
    std::vector<TagId> names;
    names.reserve(tags.size());
    for (PoseIndex tag : tags) names.push_back(ids.at(tag));
    std::ranges::sort(names);
    names.erase(std::ranges::unique(names).begin(), names.end());
    return names;
  };
  for (const MovedTag& moved : map.moved_tags) ids[*moved.earlier] = moved.tag;
  for (const DuplicateTag& duplicate : map.duplicate_tags) ids[duplicate.other] = duplicate.tag;
  std::vector<char> moves = map.problem.moves;
  moves.resize(map.problem.bundle.poses.size(), 0);
  for (const ThinCut& cut : unchecked_cuts(map.problem.bundle, map.covariance, moves, roots_of(map)))
    map.thin_cuts.push_back({named(cut.beyond), named(cut.by), cut.observations, cut.otherwise_sigma_m});
}

/// Puts the common factor of all sizes into the scene.
void report_common_size(SceneMap& map) {
  map.size_scale = std::exp(map.problem.bundle.common_size.log_scale);
  map.size_sigma = map.size_scale * std::sqrt(map.covariance.common_size);
  for (SceneBody& body : map.scene.bodies) {
    for (SceneTag& tag : body.tags) tag.size_m *= map.size_scale;
  }
}

/// Puts the sizes that were found into the scene.
void list_wrong_sizes(SceneMap& map) {
  const std::vector<SizeEstimate> estimates = size_estimates(map.problem.bundle, map.covariance);
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const std::size_t size = map.problem.sizes[b][t];
      const bool released = std::ranges::find(map.released_sizes, size) != map.released_sizes.end();
      if (!released || map.placed[map.problem.tags[b][t]] == 0) continue;
      SceneTag& tag = map.scene.bodies[b].tags[t];
      const auto wrong = wrong_size(tag.id, tag.size_m / map.size_scale, size, map.problem.bundle, estimates,
                                    std::max(map.size_spread, map.assumed_size_spread));
      if (!wrong) continue;
      map.wrong_sizes.push_back(*wrong);
      tag.size_m = wrong->found_m;
    }
  }
}

}  // namespace

void report_scene(const SceneRecording& recording, SceneMap& map) {
  map.covariance = covariance(map.problem.bundle);
  report_common_size(map);
  list_wrong_sizes(map);
  report_intrinsics(map);
  measure_reprojection(map);
  list_rejected(recording, map);
  remove_contradicted_tags(map);
  list_unconnected(map);
  list_thin_cuts(map);
  map.prior_only = tags_on_prior_alone(map);
  report_odometry(recording, map);
  map.missing_tags = missing_scene_tags(recording, map);
}

namespace {

constexpr std::size_t kMaxLines = 5;  // of each kind

/// The names of tags, such as "tags 3, 40-78 and 99".
std::string names_of(const std::vector<TagId>& tags) {
  std::vector<int> numbers;
  numbers.reserve(tags.size());
  for (const TagId& tag : tags) numbers.push_back(tag.number);
  std::ranges::sort(numbers);
  std::vector<std::string> runs;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t end = i;
    while (end + 1 < numbers.size() && numbers[end + 1] <= numbers[end] + 1) ++end;
    const bool long_run = end >= i + 2;
    runs.push_back(long_run ? fmt::format("{}-{}", numbers[i], numbers[end]) : std::to_string(numbers[i]));
    i = long_run ? end + 1 : i + 1;
  }
  constexpr std::size_t kMaxRuns = 12;
  const std::size_t all = runs.size();
  if (all > kMaxRuns) runs.resize(kMaxRuns);
  return fmt::format("tag{} {}{}", tags.size() == 1 ? "" : "s", fmt::join(runs, ", "),
                     all > kMaxRuns ? ", ..." : "");
}

/// The number of observations of a tag, and how many of them are in use.
struct Counts {
  int all = 0, used = 0;
};

std::vector<Counts> counts_of(const SceneMap& map) {
  std::vector<Counts> counts(map.problem.bundle.poses.size());
  for (const CornerTerm& term : map.problem.bundle.corners) {
    ++counts[term.tag].all;
    counts[term.tag].used += term.used ? 1 : 0;
  }
  return counts;
}

template <class Visit>
void for_tags(const SceneMap& map, const Visit& visit) {
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t)
      visit(map.scene.bodies[b].tags[t], map.problem.tags[b][t]);
  }
}

void warn_of_priors(const SceneMap& map, std::vector<std::string>& warnings) {
  const auto check = [&](const std::string& name, PoseIndex pose, const std::optional<ScenePrior>& prior) {
    if (!prior || map.placed[pose] == 0 || map.problem.bundle.poses[pose].fixed) return;
    const SE3& now = map.problem.bundle.poses[pose].value;
    const bool used = std::ranges::find(map.rejected_priors, pose) == map.rejected_priors.end();
    const std::optional<double> sigmas =
        contradiction_sigmas(prior->factor(), now, map.covariance.poses[pose], used);
    if (!sigmas) return;
    constexpr double kResolved_px = 0.1;  // smaller differences from a given pose are not visible in images
    const std::optional<double> shift_px = largest_shift_px(map.problem.bundle, pose, prior->mean);
    if (shift_px && *shift_px < kResolved_px) return;
    const SE3 off = prior->mean.inverse() * now;
    warnings.push_back(
        fmt::format("the observations contradict the given pose of {} ({:.1f} sigma){}; in the map it is "
                    "{:.4f} m and {:.2f} "
                    "deg from it",
                    name, *sigmas, used ? "" : ", which is not used", off.translation().norm(),
                    to_degrees(off.rotation().log().norm())));
  };
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c)
    check("camera " + map.scene.cameras[c].name, map.problem.cameras[c], map.scene.cameras[c].body_T_cam);
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    if (map.scene.bodies[b].is_static)
      check("body " + map.scene.bodies[b].name, map.problem.bodies[b].front(),
            map.scene.bodies[b].map_T_body);
  }
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) {
    const MovedTag* moved = find_moved(map, tag.id);
    check("tag " + std::to_string(tag.id.number), moved ? *moved->earlier : pose, tag.body_T_tag);
  });
}

void warn_of_measurements(const SceneMap& map, std::vector<std::string>& warnings) {
  constexpr double kGate = 3;
  std::map<PoseIndex, int> number;
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) { number[pose] = tag.id.number; });
  const auto at = [&](const BundlePoint& p) { return map_point(map.problem.bundle, p); };
  const auto in_map = [&](const BundlePoint& p) { return map.placed[p.tag] != 0 && map.placed[p.body] != 0; };
  for (const PointDistanceTerm& term : map.problem.bundle.point_distances) {
    const double off = (at(term.a) - at(term.b)).norm() - term.measured_m;
    if (in_map(term.a) && in_map(term.b) && std::abs(off) > kGate * term.sigma_m)
      warnings.push_back(fmt::format(
          "given distance of {:.4f} m between tags {} and {}: the map differs by {:+.4f} m ({:.1f} sigma)",
          term.measured_m, number[term.a.tag], number[term.b.tag], off, std::abs(off) / term.sigma_m));
  }
  for (const PointCoordinateTerm& term : map.problem.bundle.point_coordinates) {
    const double off = term.direction.dot(at(term.point)) - term.measured_m;
    if (in_map(term.point) && std::abs(off) > kGate * term.sigma_m)
      warnings.push_back(
          fmt::format("given coordinate of {:.4f} m of tag {}: the map differs by {:+.4f} m ({:.1f} sigma)",
                      term.measured_m, number[term.point.tag], off, std::abs(off) / term.sigma_m));
  }
  const double off = std::abs(map.size_scale - 1);
  if (off > kGate * map.size_prior_sigma)
    warnings.push_back(
        fmt::format("according to the given distances, poses or odometry, tags are {:.3f} times their given "
                    "size ({:.1f} sigma)",
                    map.size_scale, off / map.size_prior_sigma));
}

void warn_of_cameras(const SceneMap& map, std::vector<std::string>& warnings) {
  constexpr double kGate = 3;
  for (const FoundIntrinsics& lens : map.intrinsics) {
    for (Eigen::Index i = 0; i < lens.found.size(); ++i) {
      const double off = lens.found[i] - lens.given[i];
      if (std::abs(off) > kGate * lens.prior_sigma[i])
        warnings.push_back(fmt::format("camera {}: {} is estimated as {:.6g}, given {:.6g} ({:.1f} sigma)",
                                       map.scene.cameras[lens.camera].name,
                                       lens.names[static_cast<std::size_t>(i)], lens.found[i], lens.given[i],
                                       std::abs(off) / lens.prior_sigma[i]));
    }
  }
}

void warn_of_sizes(const SceneMap& map, std::vector<std::string>& warnings) {
  for (const WrongSize& wrong : map.wrong_sizes)
    warnings.push_back(fmt::format(
        "tag {}: its observations fit a side of {:.4f} +- {:.4f} m, given {:.4f} m ({:.1f} "
        "sigma); the map has the side that fits. Measure its black square; if {:.4f} m is correct, "
        "check the calibration, and whether the tag was moved",
        wrong.tag.number, wrong.found_m, wrong.sigma_m, wrong.given_m, wrong.deviations, wrong.given_m));
  constexpr double kClearlyMore = 1.5;
  if (map.size_spread > kClearlyMore * map.assumed_size_spread)
    warnings.push_back(
        fmt::format("printed sizes differ from the given ones by {:.1f} % (one sigma), assumed {:.1f} %; the "
                    "covariances contain "
                    "this. Measure the black squares, or set `tag_size_sigma_percent`",
                    100 * map.size_spread, 100 * map.assumed_size_spread));
}

void warn_of_changes(const SceneMap& map, std::vector<std::string>& warnings) {
  const auto name = [](const TagId& tag) { return fmt::format("tag {}", tag.number); };
  for (const MovedTag& moved : map.moved_tags)
    warnings.push_back(fmt::format("{}: {}", name(moved.tag), describe(moved)));
  for (std::string& warning : describe(map.missing_tags, name)) warnings.push_back(std::move(warning));
}

std::string point_of(const Eigen::Vector3d& p_m) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p_m.x(), p_m.y(), p_m.z());
}

std::string cause_of(const DuplicateTag& duplicate) {
  if (duplicate.at_once) return "also at once: two tags carry this id; change one of them";
  const std::string moved = duplicate.one_after_the_other ? "moved" : "moved repeatedly";
  return fmt::format(
      "but never at once: two tags carry this id, or one tag was {}; change one of the two, or map a "
      "recording "
      "in which it is not moved",
      moved);
}

void warn_of_duplicates(const SceneMap& map, std::vector<std::string>& warnings) {
  const std::size_t all = map.duplicate_tags.size();
  for (std::size_t i = 0; i < std::min(all, kMaxLines); ++i) {
    const DuplicateTag& duplicate = map.duplicate_tags[i];
    const std::string frame =
        duplicate.moving_body.empty() ? "" : fmt::format(" (in the frame of `{}`)", duplicate.moving_body);
    warnings.push_back(
        fmt::format("tag {}: observed at two places, {:.2f} m apart ({} and {} times), {}. The map has the "
                    "tag at {}, not "
                    "the one at {}{}",
                    duplicate.tag.number, duplicate.distance_m, duplicate.here, duplicate.there,
                    cause_of(duplicate), point_of(duplicate.here_m), point_of(duplicate.there_m), frame));
  }
  if (all > kMaxLines) warnings.push_back(fmt::format("{} more places of duplicate tags", all - kMaxLines));
}

void warn_of_tags(const SceneMap& map, std::vector<std::string>& warnings) {
  const std::vector<Counts> counts = counts_of(map);
  struct Line {
    bool known;
    int rejected;
    std::string warnings;
  };
  std::vector<Line> lines;
  std::vector<TagId> alone;
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) {
    const Counts& count = counts[pose];
    if (std::ranges::find(map.wrong_sizes, tag.id, &WrongSize::tag) != map.wrong_sizes.end()) return;
    if (find_moved(map, tag.id) != nullptr) return;
    if (std::ranges::find(map.duplicate_tags, tag.id, &DuplicateTag::tag) != map.duplicate_tags.end()) return;
    const bool known = tag.body_T_tag.has_value() || map.problem.bundle.poses[pose].fixed;
    if (known && count.used == 0 && map.placed[pose] != 0) alone.push_back(tag.id);
    const int rejected = count.all - count.used;
    constexpr double kMinRejectedShare = 0.3;
    if (map.placed[pose] == 0 || count.all < 4 || rejected < kMinRejectedShare * count.all) return;
    lines.push_back(
        {known, rejected,
         fmt::format("{} of {} observations of tag {} are rejected{}", rejected, count.all, tag.id.number,
                     known ? "; check its given pose and size, and that its id is unique" : "")});
  });
  std::ranges::stable_sort(lines, std::greater<>{},
                           [](const Line& l) { return std::pair(l.known, l.rejected); });
  if (lines.size() > kMaxLines) lines.resize(kMaxLines);
  for (Line& line : lines) warnings.push_back(std::move(line.warnings));
  if (!alone.empty())
    warnings.push_back(names_of(alone) + ": no accepted observations; the map has the given pose");
}

std::string observations(int count) {
  return count == 1 ? "one observation" : fmt::format("{} observations", count);
}

void warn_of_prior_only(const SceneMap& map, std::vector<std::string>& warnings) {
  if (map.prior_only.empty()) return;
  std::vector<TagId> tags;
  int count = 0;
  for (const auto& [tag, used] : map.prior_only) {
    tags.push_back(tag);
    count += used;
  }
  warnings.push_back(fmt::format(
      "{}: placed by the given pose alone; {} connect{} to no other tag. Film {} in one image with "
      "other tags, or check the given pose",
      names_of(tags), observations(count), count == 1 ? "s" : "", tags.size() == 1 ? "it" : "each"));
}

void warn_of_thin_cuts(const SceneMap& map, std::vector<std::string>& warnings) {
  for (const TagCut& cut : map.left_out_cuts) {
    warnings.push_back(fmt::format("{}: excluded; connected only by {} of {}, without confirmation by others",
                                   names_of(cut.beyond), observations(cut.observations), names_of(cut.by)));
  }
  for (std::string& warning : describe(map.thin_cuts, names_of)) warnings.push_back(std::move(warning));
  if (!map.undetermined.empty())
    warnings.push_back(names_of(map.undetermined) + ": pose not determined by the observations");
}

void warn_of_odometry(const SceneMap& map, std::vector<std::string>& warnings) {
  constexpr double kClearlyNoisier = 2;
  if (map.odometry_ratio > kClearlyNoisier)
    warnings.push_back(fmt::format("odometry is {:.1f} times noisier than stated; the map uses this noise",
                                   map.odometry_ratio));
  if (!map.rejected_odometry.empty()) {
    const RejectedOdometry& worst = map.rejected_odometry.front();
    const std::size_t others = map.rejected_odometry.size() - 1;
    warnings.push_back(fmt::format(
        "odometry between {:.2f} s and {:.2f} s contradicts the tags by {:.3f} m and {:.2f} deg{}; it is not "
        "used there",
        worst.from_s, worst.to_s, worst.off_m, to_degrees(worst.off_rad),
        others == 0   ? ""
        : others == 1 ? ", and at one other time by less"
                      : fmt::format(", and at {} other times by less", others)));
  }
  for (std::size_t i = 0; i < std::min(map.odometry_links.size(), kMaxLines); ++i) {
    const OdometryLink& link = map.odometry_links[i];
    warnings.push_back(fmt::format(
        "{}: connected to the other tags by odometry alone (at least {:.1f} m, {} frame{}); an error of "
        "odometry there is not in the stated deviations. Film both groups in one image",
        names_of(link.beyond), link.length_m, link.frames, link.frames == 1 ? "" : "s"));
  }
  if (map.odometry_links.size() > kMaxLines)
    warnings.push_back(fmt::format("{} more groups of tags are connected by odometry alone",
                                   map.odometry_links.size() - kMaxLines));
}

void warn_of_misread_ids(const SceneMap& map, std::vector<std::string>& warnings) {
  const std::size_t all = map.corrected_ids.size();
  if (all == 0) return;
  std::vector<std::string> cases;
  for (std::size_t i = 0; i < std::min(all, kMaxLines); ++i)
    cases.push_back(
        fmt::format("{} for {}", map.corrected_ids[i].read.number, map.corrected_ids[i].is.number));
  warnings.push_back(
      fmt::format("{} observation{} had a misread id and {} used for the tag at that position: {}{}", all,
                  all == 1 ? "" : "s", all == 1 ? "was" : "were", fmt::join(cases, ", "),
                  all > kMaxLines ? ", ..." : ""));
}

void warn_of_unusual_sizes(const SceneMap& map, std::vector<std::string>& warnings) {
  for (const SceneBody& body : map.scene.bodies) {
    TagSizes sizes;
    if (body.default_tag_size_m > 0) sizes.default_size_m = body.default_tag_size_m;
    for (const SceneTag& tag : body.tags) {
      if (tag.size_m != body.default_tag_size_m) sizes.size_by_tag_m.emplace(tag.id, tag.size_m);
    }
    for (std::string& warning : sizes.warnings()) warnings.push_back(std::move(warning));
  }
}

}  // namespace

std::vector<std::string> scene_warnings(const SceneMap& map) {
  std::vector<std::string> warnings;
  warn_of_unusual_sizes(map, warnings);
  warn_of_priors(map, warnings);
  warn_of_measurements(map, warnings);
  warn_of_cameras(map, warnings);
  warn_of_sizes(map, warnings);
  warn_of_changes(map, warnings);
  warn_of_duplicates(map, warnings);
  warn_of_tags(map, warnings);
  warn_of_prior_only(map, warnings);
  warn_of_thin_cuts(map, warnings);
  warn_of_odometry(map, warnings);
  warn_of_misread_ids(map, warnings);
  return warnings;
}

double corner_chi2_per_dof(const SceneMap& map) {
  const Bundle& bundle = map.problem.bundle;
  std::map<std::pair<std::size_t, std::size_t>, std::pair<double, int>> views;
  std::set<PoseIndex> tags;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    CornerFactor own = term.factor;
    own.whitening = map.observations.seen[i].factor.whitening;
    own.isotropic = map.observations.seen[i].factor.isotropic;
    if (!term.used || own.isotropic) continue;
    const auto r = corner_residual(own, bundle.cameras[term.camera], poses_of(bundle, term));
    if (!r) continue;
    auto& [sum, count] = views[{term.camera, map.observations.seen[i].frame}];
    sum += r->squaredNorm();
    ++count;
    tags.insert(term.tag);
  }
  double sum = 0;
  double freedom = -6.0 * static_cast<double>(tags.size());
  for (const auto& [key, view] : views) {
    if (view.second < 2) continue;
    sum += view.first;
    freedom += 8 * view.second - 6;
  }
  return freedom > 0 ? sum / freedom : 0;
}

}  // namespace waymark
