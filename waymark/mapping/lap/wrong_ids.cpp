#include "waymark/mapping/lap/wrong_ids.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <utility>

#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark::internal {
namespace {

/// Odometry pose, distance driven and rotation as functions of time.
class SiteWheels {
 public:
  struct Moment {
    SE2 odom_T_base{};
    double driven_m = 0;
    double turned_rad = 0;
  };

  explicit SiteWheels(const std::vector<Odometry>& odometry) : odometry_(odometry) {
    moments_.reserve(odometry.size());
    for (const Odometry& sample : odometry) {
      Moment now{sample.odom_T_base, 0, 0};
      if (!moments_.empty()) {
        const SE2 step = moments_.back().odom_T_base.inverse() * now.odom_T_base;
        now.driven_m = moments_.back().driven_m + step.translation().norm();
        now.turned_rad = moments_.back().turned_rad + std::abs(step.yaw());
      }
      moments_.push_back(now);
    }
  }

  [[nodiscard]] std::optional<Moment> at(SensorTime stamp) const {
    const auto after = std::ranges::lower_bound(odometry_, stamp, {}, &Odometry::stamp);
    if (after == odometry_.end()) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - odometry_.begin());
    if (after->stamp == stamp || i == 0) return moments_[i];
    const double u =
        to_seconds(stamp - odometry_[i - 1].stamp) / to_seconds(after->stamp - odometry_[i - 1].stamp);
    return Moment{interpolate(moments_[i - 1].odom_T_base, moments_[i].odom_T_base, u), moments_[i].driven_m,
                  moments_[i].turned_rad};
  }

 private:
  const std::vector<Odometry>& odometry_;
  std::vector<Moment> moments_;
};

double apart_m(const WheelObservation& before, const WheelObservation& now) {
  return (now.odom_p - before.odom_p).norm();
}

/// The largest apparent distance between two observations of a fixed tag if the robot has driven only a short
/// distance between them.
double max_jump_soon_m(const WheelObservation& before, const WheelObservation& now) {
  constexpr double kBase_m = 0.1;
  constexpr double kPerDistance = 0.06;
  constexpr double kPerMetre = 0.3;
  constexpr double kPerRadian = 0.3;
  return kBase_m + kPerDistance * now.distance_m + kPerMetre * (now.driven_m - before.driven_m) +
         kPerRadian * (now.turned_rad - before.turned_rad) * now.distance_m;
}

/// The same for a longer drive, over which the odometry error is at most a share of the distance.
double max_jump_later_m(const WheelObservation& before, const WheelObservation& now) {
  constexpr double kBase_m = 1.0;
  constexpr double kPerMetre = 0.2;
  const double long_way = kBase_m + kPerMetre * (now.driven_m - before.driven_m + now.distance_m);
  return std::min(max_jump_soon_m(before, now), long_way);
}

/// The admissible site whose last observation is nearest to an observation.
template <class May>
WheelSite* nearest(std::vector<WheelSite>& sites, const WheelObservation& now, const May& may) {
  WheelSite* best = nullptr;
  for (WheelSite& site : sites) {
    if (!may(site.seen.back())) continue;
    if (best == nullptr || apart_m(site.seen.back(), now) < apart_m(best->seen.back(), now)) best = &site;
  }
  return best;
}

/// Adds an observation to its track, or starts a new track.
void add_to_tracks(const WheelObservation& now, std::vector<WheelSite>& tracks) {
  constexpr double kSoon_m = 1.0;
  WheelSite* track = nearest(tracks, now, [&](const WheelObservation& last) {
    return now.driven_m - last.driven_m < kSoon_m && apart_m(last, now) < max_jump_soon_m(last, now);
  });
  if (track == nullptr) track = &tracks.emplace_back();
  track->seen.push_back(now);
}

/// Merges tracks if the tag is observed again within the possible odometry error. Short tracks are due to
/// misread ids and are dropped.
std::vector<WheelSite> joined(const std::vector<WheelSite>& tracks) {
  constexpr std::size_t kMinTrackLength = 8;
  constexpr double kMinPassDistance_m = 3.0;
  std::vector<WheelSite> sites;
  for (const WheelSite& track : tracks) {
    if (track.seen.size() < kMinTrackLength) continue;
    const WheelObservation& first = track.seen.front();
    WheelSite* site = nearest(sites, first, [&](const WheelObservation& last) {
      return last.index < first.index && apart_m(last, first) < max_jump_later_m(last, first);
    });
    if (site == nullptr) {
      sites.push_back(track);
      continue;
    }
    site->passed_twice =
        site->passed_twice || first.driven_m - site->seen.back().driven_m > kMinPassDistance_m;
    site->seen.insert(site->seen.end(), track.seen.begin(), track.seen.end());
  }
  return sites;
}

/// The mean of some of a site's observations, and the variance of this mean.
struct SiteWindow {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double variance_m2 = 0;
  double driven_m = 0;
  double turned_rad = 0;
};

SiteWindow window(const WheelSite& site, std::size_t first, std::size_t count) {
  SiteWindow w;
  const auto n = static_cast<double>(count);
  for (std::size_t i = first; i < first + count; ++i) {
    w.mean += site.seen[i].odom_p / n;
    w.driven_m += site.seen[i].driven_m / n;
    w.turned_rad += site.seen[i].turned_rad / n;
  }
  for (std::size_t i = first; i < first + count; ++i)
    w.variance_m2 += (site.seen[i].odom_p - w.mean).squaredNorm() / (n * (n - 1));
  return w;
}

/// The first observation after which a site is significantly displaced relative to the observations just
/// before.
std::optional<std::size_t> jump_of(const WheelSite& site) {
  constexpr std::size_t kWindowLength = 8;
  constexpr double kMinJump_m = 0.05;
  constexpr double kPerDistance = 0.015;  // the distance to small tags is inaccurate
  constexpr double kPerMetre = 0.1;
  constexpr double kPerRadian = 0.15;
  constexpr double kSigmas = 5;
  constexpr double kMaxSpan_m = 1;
  std::optional<std::size_t> jump;
  double clearest = 1;
  for (std::size_t at = kWindowLength; at + kWindowLength <= site.seen.size(); ++at) {
    if (site.seen[at + kWindowLength - 1].driven_m - site.seen[at - kWindowLength].driven_m > kMaxSpan_m)
      continue;
    const SiteWindow before = window(site, at - kWindowLength, kWindowLength);
    const SiteWindow after = window(site, at, kWindowLength);
    const double gate = kMinJump_m + kPerDistance * site.seen[at].distance_m +
                        kPerMetre * (after.driven_m - before.driven_m) +
                        kPerRadian * (after.turned_rad - before.turned_rad) * site.seen[at].distance_m +
                        kSigmas * std::sqrt(before.variance_m2 + after.variance_m2);
    const double clear = (after.mean - before.mean).norm() / gate;
    if (clear <= clearest) continue;
    clearest = clear;
    jump = at;
  }
  return jump;
}

/// Splits sites until none of their parts jumps.
void split_at_jumps(std::vector<WheelSite>& sites) {
  for (std::size_t i = 0; i < sites.size(); ++i) {
    while (const auto jump = jump_of(sites[i])) {
      auto& seen = sites[i].seen;
      const auto at = seen.begin() + static_cast<std::ptrdiff_t>(*jump);
      WheelSite after{.seen = {at, seen.end()}};
      seen.erase(at, seen.end());
      sites.push_back(std::move(after));
    }
  }
}

}  // namespace

std::map<TagId, std::vector<WheelSite>> wheel_sites(const LapInput& lap,
                                                    const std::vector<ObservedFrame>& observed) {
  std::map<TagId, std::vector<WheelSite>> sites;
  const SiteWheels wheels(lap.odometry);
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const auto now = wheels.at(observed[f].stamp);
    if (!now) continue;
    std::size_t next = 0;  // there is no observation for detections without a pose
    const auto& detections = lap.frames[f].detections;
    for (std::size_t d = 0; d < detections.size() && next < observed[f].tags.size(); ++d) {
      const TagPoseObservation& seen = observed[f].tags[next];
      if (detections[d].tag != seen.tag) continue;
      ++next;
      const SE3 odom_T_tag =
          lift(now->odom_T_base) * observed[f].base_T_cam.value_or(lap.base_T_cam) * seen.cam_T_tag;
      add_to_tracks({{f, d},
                     odom_T_tag.translation().head<2>(),
                     seen.cam_T_tag.translation().norm(),
                     now->driven_m,
                     now->turned_rad},
                    sites[seen.tag]);
    }
  }
  for (auto& [tag, of_tag] : sites) {
    of_tag = joined(of_tag);
    split_at_jumps(of_tag);
  }
  return sites;
}

namespace {

using Sites = std::map<TagId, std::vector<WheelSite>>;
constexpr std::size_t kMinObservationsOfASite = 8;  // a smaller number is attributed to misread ids
constexpr double kSoon_m = 0.5;  // over this distance, odometry is accurate to a centimetre

/// How the observations of a site are related in time to those of another site of the tag.
enum class Second : std::uint8_t { ByTurns, Jumped, Later };

/// A site of a tag beside its main one. Sites are indices into DividedTag::sites.
struct SecondSite {
  std::size_t site = 0;
  std::size_t other = 0;  ///< the main site or a neighbour in time, whichever is related more closely
  Second how = Second::Later;
  double driven_m = 0;    ///< distance driven at the time of the jump
  bool accepted = false;  ///< whether the tag is elsewhere there
};

/// A tag with several sites.
struct DividedTag {
  TagId tag{};
  bool is_anchor = false;
  std::vector<const WheelSite*> sites{};  ///< in the order of their ends, those of the anchor of their starts
  std::size_t main = 0;                   ///< the site with the most observations
  std::vector<SecondSite> seconds{};
};

/// Counts how often the observations of two sites, in chronological order, change from one site to the other
/// within a short distance.
SecondSite compare(const DividedTag& tag, std::size_t site, std::size_t other) {
  constexpr int kMinAlternations = 4;
  SecondSite second{.site = site, .other = other};
  const std::vector<WheelObservation>& seen_here = tag.sites[site]->seen;
  const std::vector<WheelObservation>& seen_there = tag.sites[other]->seen;
  int turns = 0;
  const WheelObservation* last = nullptr;
  bool last_is_here = false;
  auto a = seen_here.begin();
  auto b = seen_there.begin();
  while (a != seen_here.end() || b != seen_there.end()) {
    const bool is_here = b == seen_there.end() || (a != seen_here.end() && a->index < b->index);
    const WheelObservation& now = is_here ? *a++ : *b++;
    if (last != nullptr && is_here != last_is_here && now.driven_m - last->driven_m < kSoon_m) {
      ++turns;
      second.driven_m = now.driven_m;
    }
    last = &now;
    last_is_here = is_here;
  }
  if (turns > 0) second.how = turns < kMinAlternations ? Second::Jumped : Second::ByTurns;
  return second;
}

/// A tag that was moved more than once jumps between sites that need not be the main one.
SecondSite second_site(const DividedTag& tag, std::size_t site) {
  SecondSite closest = compare(tag, site, tag.main);
  const auto consider = [&](std::size_t other) {
    const SecondSite beside = compare(tag, site, other);
    if (beside.how < closest.how) closest = beside;
  };
  if (site > 0) consider(site - 1);
  if (site + 1 < tag.sites.size()) consider(site + 1);
  return closest;
}

/// Observations around a point of the drive, and their displacement from those before it to those after it.
struct Displacement {
  int before = 0, after = 0;  ///< number of observations
  double length_m = 0;        ///< 0 if there are none before or after
  double distance_m = 0;      ///< mean distance of the tag from the camera
};

Displacement displacement_at(double driven_m, std::initializer_list<const WheelSite*> sites) {
  Displacement result;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  Eigen::Vector2d after = Eigen::Vector2d::Zero();
  for (const WheelSite* site : sites) {
    for (const WheelObservation& seen : site->seen) {
      if (seen.driven_m < driven_m - kSoon_m || seen.driven_m >= driven_m + kSoon_m) continue;
      const bool is_after = seen.driven_m >= driven_m;
      (is_after ? after : before) += seen.odom_p;
      ++(is_after ? result.after : result.before);
      result.distance_m += seen.distance_m;
    }
  }
  if (result.before == 0 || result.after == 0) return result;
  result.length_m = (after / result.after - before / result.before).norm();
  result.distance_m /= result.before + result.after;
  return result;
}

/// Whether a site was observed both just before and just after a jump, and would have jumped with an error of
/// odometry. An error of its turns displaces a nearer tag less.
bool is_still(const WheelSite& site, double driven_m, const Displacement& jump) {
  constexpr int kMinObservationsAround = 4;
  constexpr double kMaxShare = 0.5;  // of the displacement that an error of odometry would cause
  const Displacement here = displacement_at(driven_m, {&site});
  if (std::min(here.before, here.after) < kMinObservationsAround) return false;
  return here.length_m < kMaxShare * jump.length_m * std::min(1.0, here.distance_m / jump.distance_m);
}

std::size_t main_of(const std::vector<WheelSite>& sites) {
  return static_cast<std::size_t>(
      std::ranges::max_element(sites, {}, [](const WheelSite& s) { return s.seen.size(); }) - sites.begin());
}

/// The sites in the order of their ends, or of their starts. The first and the last few observations of a
/// site do not count, because they may belong to another one.
std::vector<const WheelSite*> in_order(const std::vector<WheelSite>& sites, bool by_starts) {
  constexpr std::size_t kExceptions = kMinObservationsOfASite / 2;
  std::vector<const WheelSite*> ordered;
  for (const WheelSite& site : sites) {
    if (site.seen.size() >= kMinObservationsOfASite) ordered.push_back(&site);
  }
  std::ranges::stable_sort(ordered, {}, [&](const WheelSite* site) {
    return site->seen[by_starts ? kExceptions - 1 : site->seen.size() - kExceptions].index;
  });
  return ordered;
}

std::vector<DividedTag> divided_tags(const Sites& all, const TagId& anchor) {
  std::vector<DividedTag> tags;
  for (const auto& [id, sites] : all) {
    DividedTag tag{.tag = id, .is_anchor = id == anchor, .sites = in_order(sites, id == anchor)};
    if (tag.sites.size() < 2) continue;
    const auto main =
        std::ranges::max_element(tag.sites, {}, [](const auto* site) { return site->seen.size(); });
    tag.main = static_cast<std::size_t>(main - tag.sites.begin());
    for (std::size_t i = 0; i < tag.sites.size(); ++i) {
      if (i != tag.main) tag.seconds.push_back(second_site(tag, i));
    }
    tags.push_back(std::move(tag));
  }
  return tags;
}

/// Whether, at the time of the jump, at least as many tags were stationary as jumped. With an error of
/// odometry instead, all stationary tags would have been moved at this time, which is one change more.
bool jumped_without_others(const DividedTag& of, const SecondSite& jumped,
                           const std::vector<DividedTag>& tags, const Sites& all) {
  const Displacement jump = displacement_at(jumped.driven_m, {of.sites[jumped.site], of.sites[jumped.other]});
  const auto jumps = std::ranges::count_if(tags, [&](const DividedTag& tag) {
    return std::ranges::any_of(tag.seconds, [&](const SecondSite& other) {
      return other.how == Second::Jumped && std::abs(other.driven_m - jumped.driven_m) < kSoon_m;
    });
  });
  const auto still = std::ranges::count_if(all, [&](const auto& of_tag) {
    return std::ranges::any_of(of_tag.second,
                               [&](const WheelSite& site) { return is_still(site, jumped.driven_m, jump); });
  });
  return still >= jumps;
}

/// The number of tags that were passed twice and observed in only one place.
std::ptrdiff_t found_again(const Sites& all) {
  return std::ranges::count_if(all, [](const auto& of_tag) {
    const auto enough = [](const WheelSite& site) { return site.seen.size() >= kMinObservationsOfASite; };
    return std::ranges::count_if(of_tag.second, enough) == 1 &&
           of_tag.second[main_of(of_tag.second)].passed_twice;
  });
}

/// Decides which sites are places where the tag is not.
void accept(const Sites& all, std::vector<DividedTag>& tags) {
  std::ptrdiff_t later = 0;
  for (const DividedTag& tag : tags)
    later += std::ranges::count(tag.seconds, Second::Later, &SecondSite::how);
  const bool wheels_are_right = later <= found_again(all);
  for (DividedTag& tag : tags) {
    for (SecondSite& second : tag.seconds)
      second.accepted = second.how == Second::ByTurns ||
                        (second.how == Second::Jumped && jumped_without_others(tag, second, tags, all)) ||
                        (second.how == Second::Later && wheels_are_right);
  }
}

/// Whether a tag jumped. If it also alternates between two places, there are two tags.
bool was_moved(const DividedTag& tag) {
  const auto any = [&](Second how) {
    return std::ranges::any_of(
        tag.seconds, [&](const SecondSite& second) { return second.accepted && second.how == how; });
  };
  return any(Second::Jumped) && !any(Second::ByTurns);
}

/// A range of DividedTag::sites.
struct SiteRange {
  std::size_t from = 0, to = 0;
  [[nodiscard]] bool contains(std::size_t site) const { return site >= from && site < to; }
};

/// The sites of a moved tag after its last move. Those of the anchor before its first move, because its given
/// pose applies to that time.
SiteRange place_to_keep(const DividedTag& tag) {
  SiteRange keep{0, tag.sites.size()};
  for (const SecondSite& second : tag.seconds) {
    if (!second.accepted) continue;
    if (tag.is_anchor)
      keep.to = std::min(keep.to, std::min(second.site, second.other) + 1);
    else
      keep.from = std::max(keep.from, std::max(second.site, second.other));
  }
  return keep;
}

/// Whether a place has so many observations that those of all other places may be excluded for it. A few poor
/// poses where a tag leaves the image can look like a jump.
bool is_well_observed(const DividedTag& tag, const SiteRange& place) {
  constexpr std::size_t kMinObservations = 12;
  constexpr double kMinShare = 0.2;  // of the observations of the main site
  std::size_t observations = 0;
  for (std::size_t i = place.from; i < place.to; ++i) observations += tag.sites[i]->seen.size();
  return observations >= kMinObservations ||
         static_cast<double>(observations) >=
             kMinShare * static_cast<double>(tag.sites[tag.main]->seen.size());
}

std::vector<const WheelSite*> sites_to_exclude(const DividedTag& tag) {
  std::vector<const WheelSite*> excluded;
  const SiteRange keep = place_to_keep(tag);
  if (was_moved(tag) && is_well_observed(tag, keep)) {
    for (std::size_t i = 0; i < tag.sites.size(); ++i) {
      if (!keep.contains(i)) excluded.push_back(tag.sites[i]);
    }
    return excluded;
  }
  for (const SecondSite& second : tag.seconds) {
    if (second.accepted) excluded.push_back(tag.sites[second.site]);
  }
  return excluded;
}

}  // namespace

std::vector<ObservationIndex> observations_of_duplicate_tags(const LapInput& lap,
                                                             const std::vector<ObservedFrame>& observed) {
  const Sites all = wheel_sites(lap, observed);
  std::vector<DividedTag> tags = divided_tags(all, lap.anchor);
  accept(all, tags);
  std::set<ObservationIndex> result;
  for (const DividedTag& tag : tags) {
    for (const WheelSite* site : sites_to_exclude(tag)) {
      for (const WheelObservation& observation : site->seen) result.insert(observation.index);
    }
  }
  return {result.begin(), result.end()};
}

ExcludedObservations::ExcludedObservations(LapInput& lap, const std::vector<ObservationIndex>& observations)
    : lap_(lap) {
  excluded_.reserve(observations.size());
  for (const ObservationIndex& index : std::views::reverse(observations)) {
    std::vector<TagDetection>& detections = lap_.frames[index.frame].detections;
    const auto at = detections.begin() + static_cast<std::ptrdiff_t>(index.detection);
    excluded_.push_back({index, *at});
    detections.erase(at);
  }
}

ExcludedObservations::~ExcludedObservations() {
  for (const auto& [index, detection] : std::views::reverse(excluded_)) {
    std::vector<TagDetection>& detections = lap_.frames[index.frame].detections;
    detections.insert(detections.begin() + static_cast<std::ptrdiff_t>(index.detection), detection);
  }
}

namespace {

/// The one or two poses of a tag.
std::vector<Hypothesis> poses_of(const TagPoseObservation& seen) {
  constexpr double kMaxExcess = 30;
  std::vector<Hypothesis> poses = {{seen.cam_T_tag, seen.covariance, 0}};
  if (seen.other && seen.other->chi2 - seen.chi2 < kMaxExcess)
    poses.push_back({seen.other->cam_T_tag, seen.other->covariance, seen.other->chi2 - seen.chi2});
  return poses;
}

/// Covariance of an odometry motion before the scales and the floor are estimated.
Matrix6 covariance_of(const SE2& motion) {
  constexpr double kStep_m = 0.005;
  constexpr double kStep_rad = 0.01;
  constexpr double kShare = 0.2;
  const double metres = kStep_m + kShare * motion.translation().norm();
  const double radians = kStep_rad + kShare * std::abs(motion.yaw());
  Vector6 sigma;
  sigma << metres, metres, kStep_m, kStep_rad, kStep_rad, radians;
  return sigma.cwiseAbs2().asDiagonal();
}

std::vector<ViewMotion> motions_of(const LapInput& lap, const std::vector<ObservedFrame>& observed) {
  const OdometryTrack wheels(lap.odometry);
  std::vector<ViewMotion> motions(observed.size());
  std::optional<SE2> before;
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const std::optional<SE2> now = wheels.at(observed[f].stamp);
    if (before && now) {
      const SE2 motion = before->inverse() * *now;
      const SE3 cam_T_base = observed[f - 1].base_T_cam.value_or(lap.base_T_cam).inverse();
      const Matrix6 Ad = cam_T_base.adjoint();
      motions[f] = {true, cam_T_base * lift(motion) * observed[f].base_T_cam.value_or(lap.base_T_cam),
                    Ad * covariance_of(motion) * Ad.transpose()};
    }
    before = now;
  }
  return motions;
}

}  // namespace

std::vector<ObservationIndex> unconfirmed_observations(const LapInput& lap,
                                                       const std::vector<ObservedFrame>& observed) {
  std::vector<ObservationIndex> indices;
  std::vector<ViewedTag> seen;
  std::vector<std::vector<Hypothesis>> poses;
  std::map<TagId, std::size_t> number;
  for (std::size_t f = 0; f < observed.size(); ++f) {
    const std::vector<TagDetection>& detections = lap.frames[f].detections;
    std::size_t next = 0;  // there is no observation for detections without a pose
    for (std::size_t d = 0; d < detections.size() && next < observed[f].tags.size(); ++d) {
      const TagPoseObservation& tag = observed[f].tags[next];
      if (detections[d].tag != tag.tag) continue;
      ++next;
      indices.push_back({f, d});
      seen.push_back({f, number.try_emplace(tag.tag, number.size()).first->second, 0});
      poses.push_back(poses_of(tag));
    }
  }
  const Confirmation confirmation = confirm_observations(seen, poses, motions_of(lap, observed));
  std::vector<ObservationIndex> unconfirmed;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (confirmation.unconfirmed[i] != 0) unconfirmed.push_back(indices[i]);
  }
  return unconfirmed;
}

}  // namespace waymark::internal
