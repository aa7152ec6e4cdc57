#include "waymark/mapping/second_sites.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <utility>

#include "waymark/geometry/planar.hpp"

namespace waymark::internal {
namespace {

/// Where the wheels have a tag, as its last sighting says, and who saw it there.
struct Site {
  Eigen::Vector2d odom_p = Eigen::Vector2d::Zero();
  double driven_m = 0;        ///< when it was seen last
  bool passed_twice = false;  ///< it was found there again after some metres
  std::vector<SightingIndex> seen{};
};
using Sites = std::map<TagId, std::vector<Site>>;

/// The wheels' pose and way, moment by moment.
class Wheels {
 public:
  explicit Wheels(const std::vector<Odometry>& odometry) : odometry_(odometry) {
    driven_m_.reserve(odometry.size());
    for (std::size_t i = 0; i < odometry.size(); ++i) {
      const double step =
          i == 0 ? 0
                 : (odometry[i].odom_T_base.translation() - odometry[i - 1].odom_T_base.translation()).norm();
      driven_m_.push_back((i == 0 ? 0 : driven_m_.back()) + step);
    }
  }

  [[nodiscard]] std::optional<std::pair<SE2, double>> at(SensorTime stamp) const {
    const auto after = std::ranges::lower_bound(odometry_, stamp, {}, &Odometry::stamp);
    if (after == odometry_.end()) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - odometry_.begin());
    if (after->stamp == stamp || i == 0) return std::pair(after->odom_T_base, driven_m_[i]);
    const Odometry& before = odometry_[i - 1];
    const double u = to_seconds(stamp - before.stamp) / to_seconds(after->stamp - before.stamp);
    return std::pair(interpolate(before.odom_T_base, after->odom_T_base, u), driven_m_[i]);
  }

 private:
  const std::vector<Odometry>& odometry_;
  std::vector<double> driven_m_;
};

void add_to_sites(const Eigen::Vector2d& odom_p, double distance_m, double driven_m,
                  const SightingIndex& index, std::vector<Site>& sites) {
  constexpr double kSlack_m = 1.0;
  constexpr double kDrift =
      0.2;  // of the way since, and of the distance to a tag whose pose may be the other one
  constexpr double kLater_m = 3.0;
  Site* home = nullptr;
  double nearest_m = 0;
  for (Site& site : sites) {
    const double apart_m = (odom_p - site.odom_p).norm();
    if (apart_m > kSlack_m + kDrift * (driven_m - site.driven_m + distance_m)) continue;
    if (home != nullptr && apart_m >= nearest_m) continue;
    home = &site;
    nearest_m = apart_m;
  }
  if (home == nullptr) home = &sites.emplace_back(Site{.driven_m = driven_m});
  home->passed_twice = home->passed_twice || driven_m - home->driven_m > kLater_m;
  home->odom_p = odom_p;
  home->driven_m = driven_m;
  home->seen.push_back(index);
}

Sites sites_of(const LapInput& lap, const std::vector<ObservedFrame>& observed) {
  Sites sites;
  const Wheels wheels(lap.odometry);
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const auto now = wheels.at(observed[f].stamp);
    if (!now) continue;
    std::size_t next = 0;  // detections without a pose were not observed
    const auto& detections = lap.frames[f].detections;
    for (std::size_t d = 0; d < detections.size() && next < observed[f].tags.size(); ++d) {
      const TagPoseObservation& seen = observed[f].tags[next];
      if (detections[d].tag != seen.tag) continue;
      ++next;
      const SE3 odom_T_tag = lift(now->first) * lap.base_T_cam * seen.cam_T_tag;
      add_to_sites(odom_T_tag.translation().head<2>(), seen.cam_T_tag.translation().norm(), now->second,
                   {f, d}, sites[seen.tag]);
    }
  }
  return sites;
}

}  // namespace

std::vector<SightingIndex> sightings_of_second_sites(const LapInput& lap,
                                                     const std::vector<ObservedFrame>& observed) {
  constexpr std::size_t kEnough = 8;  // fewer are misread
  std::vector<SightingIndex> second;
  int split = 0;
  int agreeing = 0;
  for (auto& [tag, sites] : sites_of(lap, observed)) {
    const auto most = std::ranges::max_element(sites, {}, [](const Site& s) { return s.seen.size(); });
    const auto enough = std::ranges::count_if(sites, [](const Site& s) { return s.seen.size() >= kEnough; });
    agreeing += enough == 1 && most->passed_twice ? 1 : 0;
    if (enough < 2) continue;
    ++split;
    for (auto site = sites.begin(); site != sites.end(); ++site)
      if (site != most && site->seen.size() >= kEnough)
        second.insert(second.end(), site->seen.begin(), site->seen.end());
  }
  if (split > agreeing) second.clear();
  return second;
}

LapInput without(const LapInput& lap, const std::vector<SightingIndex>& sightings) {
  LapInput rest = lap;
  std::map<std::size_t, std::set<std::size_t>> gone;
  for (const SightingIndex& index : sightings) gone[index.frame].insert(index.detection);
  for (const auto& [frame, detections] : gone) {
    std::vector<TagDetection>& all = rest.frames[frame].detections;
    for (const std::size_t detection : std::views::reverse(detections))
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(detection));
  }
  return rest;
}

}  // namespace waymark::internal
