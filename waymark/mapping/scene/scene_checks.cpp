#include "waymark/mapping/scene/scene_checks.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMostLines = 5;  // of a kind

/// "tags 3, 40-78 and 99".
std::string words_of(const std::vector<TagId>& tags) {
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
  constexpr std::size_t kMostRuns = 12;
  const std::size_t all = runs.size();
  if (all > kMostRuns) runs.resize(kMostRuns);
  return fmt::format("tag{} {}{}", tags.size() == 1 ? "" : "s", fmt::join(runs, ", "),
                     all > kMostRuns ? ", ..." : "");
}

/// Observations of a tag, and how many are in use.
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

void say_what_priors_suffer(const SceneMap& map, std::vector<std::string>& words) {
  constexpr double kGate = 22.46;  // 0.999 quantile of chi-square with 6 degrees of freedom
  const auto check = [&](const std::string& name, PoseIndex pose, const std::optional<ScenePrior>& prior) {
    if (!prior || map.placed[pose] == 0 || map.problem.bundle.poses[pose].fixed) return;
    const SE3& now = map.problem.bundle.poses[pose].value;
    const Vector6 r = pose_prior_residual(prior->factor(), now);
    if (!(r.squaredNorm() > kGate)) return;
    const SE3 off = prior->mean.inverse() * now;
    words.push_back(
        fmt::format("{} is {:.4f} m and {:.2f} deg from where it is given, {:.1f} sigma: the rest "
                    "contradicts it",
                    name, off.translation().norm(), to_degrees(off.rotation().log().norm()), r.norm()));
  };
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c)
    check("camera " + map.scene.cameras[c].name, map.problem.cameras[c], map.scene.cameras[c].body_T_cam);
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    if (map.scene.bodies[b].is_static)
      check("body " + map.scene.bodies[b].name, map.problem.bodies[b].front(),
            map.scene.bodies[b].map_T_body);
  }
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) {
    check("tag " + std::to_string(tag.id.number), pose, tag.body_T_tag);
  });
}

void say_what_measurements_suffer(const SceneMap& map, std::vector<std::string>& words) {
  constexpr double kGate = 3;
  std::map<PoseIndex, int> number;
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) { number[pose] = tag.id.number; });
  const auto at = [&](const BundlePoint& p) {
    const auto& poses = map.problem.bundle.poses;
    return (poses[p.body].value * (poses[p.tag].value * p.tag_p)).eval();
  };
  const auto in_map = [&](const BundlePoint& p) { return map.placed[p.tag] != 0 && map.placed[p.body] != 0; };
  for (const PointDistanceTerm& term : map.problem.bundle.point_distances) {
    const double off = (at(term.a) - at(term.b)).norm() - term.measured_m;
    if (in_map(term.a) && in_map(term.b) && std::abs(off) > kGate * term.sigma_m)
      words.push_back(fmt::format(
          "the distance of {:.4f} m between tags {} and {} is {:+.4f} m off in the map, {:.1f} sigma: the "
          "rest "
          "contradicts it",
          term.measured_m, number[term.a.tag], number[term.b.tag], off, std::abs(off) / term.sigma_m));
  }
  for (const PointCoordinateTerm& term : map.problem.bundle.point_coordinates) {
    const double off = term.direction.dot(at(term.point)) - term.measured_m;
    if (in_map(term.point) && std::abs(off) > kGate * term.sigma_m)
      words.push_back(
          fmt::format("the coordinate of {:.4f} m of tag {} is {:+.4f} m off in the map, {:.1f} "
                      "sigma: the rest contradicts it",
                      term.measured_m, number[term.point.tag], off, std::abs(off) / term.sigma_m));
  }
  const double off_sigma = std::abs(map.size_scale - 1) / map.size_prior_sigma;
  if (off_sigma > kGate)
    words.push_back(fmt::format(
        "by the distances given, tags are {:.3f} times as large as their given sizes, {:.1f} sigma",
        map.size_scale, off_sigma));
}

void say_which_cameras_differ(const SceneMap& map, std::vector<std::string>& words) {
  constexpr double kGate = 3;
  for (const FoundIntrinsics& lens : map.intrinsics) {
    for (Eigen::Index i = 0; i < lens.found.size(); ++i) {
      const double off = lens.found[i] - lens.given[i];
      if (std::abs(off) > kGate * lens.prior_sigma[i])
        words.push_back(
            fmt::format("camera {}: {} is {:.6g} in the map and was given as {:.6g}, {:.1f} sigma",
                        map.scene.cameras[lens.camera].name, lens.names[static_cast<std::size_t>(i)],
                        lens.found[i], lens.given[i], std::abs(off) / lens.prior_sigma[i]));
    }
  }
}

void say_which_tags_contradict(const SceneMap& map, std::vector<std::string>& words) {
  const std::vector<Counts> counts = counts_of(map);
  struct Line {
    bool known;
    int rejected;
    std::string words;
  };
  std::vector<Line> lines;
  std::vector<TagId> alone;
  for_tags(map, [&](const SceneTag& tag, PoseIndex pose) {
    const Counts& count = counts[pose];
    const bool known = tag.body_T_tag.has_value() || map.problem.bundle.poses[pose].fixed;
    if (known && count.used == 0 && map.placed[pose] != 0) alone.push_back(tag.id);
    const int rejected = count.all - count.used;
    constexpr double kMany = 0.3;
    if (map.placed[pose] == 0 || count.all < 4 || rejected < kMany * count.all) return;
    lines.push_back(
        {known, rejected,
         fmt::format("{} of {} observations of tag {} contradict the rest{}", rejected, count.all,
                     tag.id.number,
                     known ? ": is it where it is given, of the size given, and there once?" : "")});
  });
  std::ranges::stable_sort(lines, std::greater<>{},
                           [](const Line& l) { return std::pair(l.known, l.rejected); });
  if (lines.size() > kMostLines) lines.resize(kMostLines);
  for (Line& line : lines) words.push_back(std::move(line.words));
  if (!alone.empty())
    words.push_back(words_of(alone) + ": on what was given alone, no observation in use says where");
}

std::string observations(int count) {
  return count == 1 ? "one observation" : fmt::format("{} observations", count);
}

void say_what_hangs_loosely(const SceneMap& map, std::vector<std::string>& words) {
  for (const SceneCut& cut : map.left_out_cuts) {
    words.push_back(fmt::format("{} hang{} on {} of {} that nothing confirms: left out", words_of(cut.beyond),
                                cut.beyond.size() == 1 ? "s" : "", observations(cut.observations),
                                words_of(cut.by)));
  }
  for (std::size_t i = 0; i < std::min(map.thin_cuts.size(), kMostLines); ++i) {
    const SceneCut& cut = map.thin_cuts[i];
    words.push_back(fmt::format("{} hang on {} of {}: if those are wrong, so is where they are",
                                words_of(cut.beyond), observations(cut.observations), words_of(cut.by)));
  }
  if (!map.undetermined.empty()) words.push_back(words_of(map.undetermined) + ": nothing determines where");
}

void say_which_ids_were_misread(const SceneMap& map, std::vector<std::string>& words) {
  const std::size_t all = map.corrected_ids.size();
  if (all == 0) return;
  std::vector<std::string> cases;
  for (std::size_t i = 0; i < std::min(all, kMostLines); ++i)
    cases.push_back(
        fmt::format("{} for {}", map.corrected_ids[i].read.number, map.corrected_ids[i].is.number));
  words.push_back(
      fmt::format("{} observation{} with the id of another tag {} where that tag cannot be, and count{} for "
                  "the tag that is there: {}{}",
                  all, all == 1 ? "" : "s", all == 1 ? "is" : "are", all == 1 ? "s" : "",
                  fmt::join(cases, ", "), all > kMostLines ? ", ..." : ""));
}

}  // namespace

std::vector<std::string> scene_doubts(const SceneMap& map) {
  std::vector<std::string> words;
  say_what_priors_suffer(map, words);
  say_what_measurements_suffer(map, words);
  say_which_cameras_differ(map, words);
  say_which_tags_contradict(map, words);
  say_what_hangs_loosely(map, words);
  say_which_ids_were_misread(map, words);
  return words;
}

}  // namespace waymark
