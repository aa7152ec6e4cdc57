#include "waymark/mapping/scene/odometry_checks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/solver/disjoint_sets.hpp"

namespace waymark {
namespace {

constexpr double kOdometryGate = 40;  // chi-square with 6 degrees of freedom; 1 of 2 million is larger
constexpr std::size_t kMinSpans = 20;

/// The median of chi-square with n degrees of freedom (Wilson and Hilferty, 1931).
double median_chi2(double n) { return n * std::pow(1 - 2 / (9 * n), 3); }

/// Steps `first` to `last` of SceneBundle::odometry, which follow each other.
struct OdometrySpan {
  std::size_t first = 0, last = 0;
};

/// For each pose, whether an observation in use contains it.
std::vector<char> observed_poses(const SceneMap& map) {
  std::vector<char> observed(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.used) observed[term.rig] = observed[term.body] = 1;
  }
  return observed;
}

const RelativeTerm& term_of(const SceneMap& map, std::size_t step) {
  return map.problem.bundle.relatives[map.problem.odometry[step].term];
}

/// The spans with an observed frame at both ends.
std::vector<OdometrySpan> odometry_spans(const SceneMap& map) {
  const std::vector<char> observed = observed_poses(map);
  std::vector<OdometrySpan> spans;
  std::optional<std::size_t> first;
  for (std::size_t i = 0; i < map.problem.odometry.size(); ++i) {
    const RelativeTerm& term = term_of(map, i);
    if (observed[term.a] != 0) first = i;
    const bool follows = i > 0 && term_of(map, i - 1).b == term.a;
    if (!follows && observed[term.a] == 0) first.reset();
    if (!first || observed[term.b] == 0) continue;
    spans.push_back({*first, i});
    first.reset();
  }
  return spans;
}

/// All steps of a span as one term between its ends.
RelativeTerm joined(const SceneMap& map, const OdometrySpan& span) {
  RelativeTerm whole = term_of(map, span.first);
  if (span.first == span.last) return whole;
  const SE3 S = whole.factor.body_T_sensor;
  SE3 motion;
  Matrix6 covariance = Matrix6::Zero();
  for (std::size_t i = span.first; i <= span.last; ++i) {
    const RelativeTerm& step = term_of(map, i);
    const Matrix6 scaled = motion.adjoint() * step.factor.whitening.inverse();
    covariance += scaled * scaled.transpose();
    motion = motion * step.factor.measured;
    whole.used = whole.used && step.used;
  }
  whole.b = term_of(map, span.last).b;
  whole.factor = {motion, S, Matrix6(covariance.llt().matrixL()).inverse()};
  return whole;
}

/// The residual of a joined term, and the share of the covariance of its ends in it, both whitened.
struct Misfit {
  Vector6 r = Vector6::Zero();
  Matrix6 J_a = Matrix6::Zero(), J_b = Matrix6::Zero();
};

Misfit misfit_of(const Bundle& bundle, const RelativeTerm& term) {
  Misfit misfit;
  misfit.r = relative_pose_residual(term.factor, bundle.poses[term.a].value, bundle.poses[term.b].value,
                                    &misfit.J_a, &misfit.J_b);
  return misfit;
}

Matrix6 projected(const Misfit& misfit, const Matrix6& P_a, const Matrix6& P_b, const Matrix6& P_ab) {
  const Matrix6 mixed = misfit.J_a * P_ab * misfit.J_b.transpose();
  return misfit.J_a * P_a * misfit.J_a.transpose() + misfit.J_b * P_b * misfit.J_b.transpose() + mixed +
         mixed.transpose();
}

/// The joined terms of spans, with the covariance of the estimated motion in each.
struct EstimatedMotions {
  std::vector<RelativeTerm> terms{};
  std::vector<Misfit> misfits{};
  std::vector<Matrix6> covariances{};  ///< whitened
};

EstimatedMotions estimated_motions(const SceneMap& map, std::vector<RelativeTerm> terms) {
  const Bundle& bundle = map.problem.bundle;
  EstimatedMotions result{.terms = std::move(terms)};
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  pairs.reserve(result.terms.size());
  for (const RelativeTerm& term : result.terms) pairs.emplace_back(term.a, term.b);
  const BundleCovariance P = covariance(bundle, pairs);
  for (std::size_t i = 0; i < result.terms.size(); ++i) {
    const RelativeTerm& term = result.terms[i];
    result.misfits.push_back(misfit_of(bundle, term));
    result.covariances.push_back(
        projected(result.misfits.back(), P.poses[term.a], P.poses[term.b], P.pairs[i]));
  }
  return result;
}

/// The poses that observations and all motions except odometry connect. Poses that are given are connected to
/// `map_frame()`.
class ImageGroups {
 public:
  explicit ImageGroups(const SceneMap& map) : map_(map), sets_(map.problem.bundle.poses.size() + 1) {
    const Bundle& bundle = map.problem.bundle;
    const auto moves = [&](PoseIndex pose) {
      return pose < map.problem.moves.size() && map.problem.moves[pose] != 0;
    };
    for (const PriorTerm& prior : bundle.priors)
      given_[prior.pose] = (prior.factor.whitening.transpose() * prior.factor.whitening).inverse();
    for (const CornerTerm& term : bundle.corners) {
      if (!term.used) continue;
      sets_.join(term.tag, term.rig);
      if (moves(term.body) || is_given(term.tag)) sets_.join(term.tag, term.body);
    }
    std::vector<char> is_odometry(bundle.relatives.size(), 0);
    for (const OdometryStep& step : map.problem.odometry) is_odometry[step.term] = 1;
    for (std::size_t i = 0; i < bundle.relatives.size(); ++i) {
      const RelativeTerm& term = bundle.relatives[i];
      if (term.used && is_odometry[i] == 0) sets_.join(term.a, term.b);
    }
    for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) connect_body(b);
  }

  [[nodiscard]] PoseIndex map_frame() const { return map_.problem.bundle.poses.size(); }
  std::size_t of(PoseIndex pose) { return sets_.root(pose); }
  void join(PoseIndex a, PoseIndex b) { sets_.join(a, b); }

 private:
  void connect_body(std::size_t b) {
    const SceneBody& body = map_.scene.bodies[b];
    if (!body.is_static) return;
    const PoseIndex of_body = map_.problem.bodies[b].front();
    const bool given = is_given(of_body);
    if (given) sets_.join(of_body, map_frame());
    for (std::size_t t = 0; t < body.tags.size(); ++t) {
      const PoseIndex tag = map_.problem.tags[b][t];
      if (!given || is_given(tag)) sets_.join(tag, of_body);
    }
  }

  /// Whether a pose is given about as precisely as the map has it. Otherwise, the odometry determines it.
  [[nodiscard]] bool is_given(PoseIndex pose) const {
    constexpr double kMaxVarianceRatio = 9;
    if (map_.problem.bundle.poses[pose].fixed) return true;
    const auto prior = given_.find(pose);
    if (prior == given_.end()) return false;
    if (map_.covariance.poses.size() <= pose) return true;
    const Matrix6& given = prior->second;
    const Matrix6& found = map_.covariance.poses[pose];
    return given.topLeftCorner<3, 3>().trace() <= kMaxVarianceRatio * found.topLeftCorner<3, 3>().trace() &&
           given.bottomRightCorner<3, 3>().trace() <=
               kMaxVarianceRatio * found.bottomRightCorner<3, 3>().trace();
  }

  const SceneMap& map_;
  internal::DisjointSets sets_;
  std::map<PoseIndex, Matrix6> given_{};  ///< the covariance of each given pose
};

bool set_used(SceneMap& map, const OdometrySpan& span, bool used) {
  bool changed = false;
  for (std::size_t i = span.first; i <= span.last; ++i) {
    RelativeTerm& term = map.problem.bundle.relatives[map.problem.odometry[i].term];
    changed = changed || term.used != used;
    term.used = used;
  }
  return changed;
}

/// chi-square of spans that are not used. The covariance of the observations is added to that of the
/// odometry, because the estimated motion does not depend on it.
std::vector<double> chi2_of_unused(const SceneMap& map, const std::vector<RelativeTerm>& terms) {
  std::vector<double> chi2;
  if (terms.empty()) return chi2;
  const EstimatedMotions motions = estimated_motions(map, terms);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Matrix6 V = Matrix6::Identity() + motions.covariances[i];
    chi2.push_back(motions.misfits[i].r.dot(V.ldlt().solve(motions.misfits[i].r)));
  }
  return chi2;
}

/// chi-square of each span.
std::vector<double> chi2_of_spans(const SceneMap& map, const std::vector<OdometrySpan>& spans) {
  std::vector<double> chi2;
  std::vector<std::size_t> unused;
  std::vector<RelativeTerm> unused_terms;
  for (const OdometrySpan& span : spans) {
    const RelativeTerm term = joined(map, span);
    chi2.push_back(misfit_of(map.problem.bundle, term).r.squaredNorm());
    if (term.used || chi2.back() <= kOdometryGate) continue;
    unused.push_back(chi2.size() - 1);
    unused_terms.push_back(term);
  }
  const std::vector<double> of_unused = chi2_of_unused(map, unused_terms);
  for (std::size_t i = 0; i < unused.size(); ++i) chi2[unused[i]] = of_unused[i];
  return chi2;
}

}  // namespace

bool has_odometry(const SceneMap& map) { return !map.problem.odometry.empty(); }

void judge_odometry(SceneMap& map) {
  for (const OdometryStep& step : map.problem.odometry) map.problem.bundle.relatives[step.term].robust = true;
}

double multiply_odometry_noise(SceneMap& map, double ratio) {
  const double factor = std::max(map.odometry_ratio * ratio, 1.0) / map.odometry_ratio;
  for (const OdometryStep& step : map.problem.odometry)
    map.problem.bundle.relatives[step.term].factor.whitening /= factor;
  map.odometry_ratio *= factor;
  return factor;
}

double rough_odometry_ratio(const SceneMap& map) {
  std::vector<double> chi2;
  for (const OdometrySpan& span : odometry_spans(map))
    chi2.push_back(misfit_of(map.problem.bundle, joined(map, span)).r.squaredNorm());
  if (chi2.size() < kMinSpans) return 1;
  return std::sqrt(median(std::move(chi2)) / median_chi2(6));
}

double odometry_ratio(const SceneMap& map) {
  constexpr double kMinRedundancy = 0.3;
  std::vector<RelativeTerm> terms;
  for (const OdometrySpan& span : odometry_spans(map)) terms.push_back(joined(map, span));
  if (terms.size() < kMinSpans) return 1;
  const EstimatedMotions motions = estimated_motions(map, std::move(terms));
  std::vector<double> ratios;
  for (std::size_t i = 0; i < motions.terms.size(); ++i) {
    const Matrix6& P = motions.covariances[i];
    const Matrix6 V = Matrix6::Identity() + (motions.terms[i].used ? -P : P);
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(V);
    const Vector6 r = eigen.eigenvectors().transpose() * motions.misfits[i].r;
    double chi2 = 0;
    int components = 0;
    for (Eigen::Index k = 0; k < 6; ++k) {
      if (!(eigen.eigenvalues()[k] > kMinRedundancy)) continue;
      chi2 += r[k] * r[k] / eigen.eigenvalues()[k];
      ++components;
    }
    if (components > 0) ratios.push_back(chi2 / median_chi2(components));
  }
  if (ratios.size() < kMinSpans) return 1;
  return std::sqrt(median(std::move(ratios)));
}

namespace {

/// Whether most observations in three successive frames are rejected, and they are of several tags.
bool are_tags_rejected_together(const SceneMap& map, const std::vector<char>& rejected) {
  constexpr int kMinFrames = 3;
  struct Frame {
    int all = 0;
    std::vector<PoseIndex> rejected{};
  };
  std::map<std::size_t, Frame> frames;
  for (std::size_t i = 0; i < rejected.size(); ++i) {
    Frame& frame = frames[map.observations.seen[i].frame];
    ++frame.all;
    if (rejected[i] != 0) frame.rejected.push_back(map.problem.bundle.corners[i].tag);
  }
  int run = 0;
  std::set<PoseIndex> tags;
  for (const auto& [index, frame] : frames) {
    if (2 * std::ssize(frame.rejected) < frame.all) {
      run = 0;
      tags.clear();
      continue;
    }
    tags.insert(frame.rejected.begin(), frame.rejected.end());
    if (++run >= kMinFrames && tags.size() > 1) return true;
  }
  return false;
}

}  // namespace

bool contradicts_odometry(const SceneMap& map, double outlier_chi2) {
  constexpr double kMaxRejectedShare = 0.05;
  const std::vector<double> of_spans = chi2_of_spans(map, odometry_spans(map));
  if (std::ranges::any_of(of_spans, [](double x) { return !(x <= kOdometryGate); })) return true;
  const std::vector<double> chi2 = corner_chi2(map.problem.bundle);
  std::vector<char> rejected;
  rejected.reserve(chi2.size());
  for (const double x : chi2) rejected.push_back(x < outlier_chi2 ? 0 : 1);
  const auto count = static_cast<double>(std::ranges::count(rejected, 1));
  return count > kMaxRejectedShare * static_cast<double>(rejected.size()) ||
         are_tags_rejected_together(map, rejected);
}

namespace {

constexpr double kNumbersOfCorners = 8;

/// The cost of contradicted spans, in rejected observations.
double cost_of_contradicted(const std::vector<double>& chi2) {
  constexpr double kFirst = 25;
  constexpr double kSecond = 75;
  constexpr double kFurther = 20;
  constexpr double kSameTime = 2;
  constexpr std::size_t kClose = 5;  // spans
  double cost = 0;
  int times = 0;
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (chi2[i] <= kOdometryGate) continue;
    if (last && i - *last <= kClose)
      cost += kSameTime;
    else
      cost += times == 0 ? kFirst : times == 1 ? kSecond : kFurther;
    times += last && i - *last <= kClose ? 0 : 1;
    last = i;
  }
  return cost;
}

}  // namespace

double cost_of_rejected(double outlier_chi2) { return (outlier_chi2 - kNumbersOfCorners) / 2; }

double cost_of_explanation(const SceneMap& map, const ExplanationOptions& options) {
  constexpr double kComponents = 6;
  const double of_rejected = cost_of_rejected(options.outlier_chi2);
  std::vector<double> of_spans = chi2_of_spans(map, odometry_spans(map));
  double sum = 0;
  for (double& chi2 : of_spans) {
    chi2 /= options.odometry_ratio * options.odometry_ratio;
    if (options.trusts_odometry || chi2 <= kOdometryGate) sum += (chi2 - kComponents) / 2;
  }
  if (!options.trusts_odometry) sum += cost_of_contradicted(of_spans) * of_rejected;
  const std::vector<double> chi2 = corner_chi2(map.problem.bundle);
  std::map<PoseIndex, int> rejected;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const CornerTerm& term = map.problem.bundle.corners[i];
    const double x = chi2[i] / (options.corner_ratio * options.corner_ratio);
    if (map.is_placed(term) && x < options.outlier_chi2)
      sum += (x - kNumbersOfCorners) / 2;
    else
      ++rejected[term.tag];
  }
  for (const auto& [tag, count] : rejected) sum += std::min(count, kMaxRejectedOfTag) * of_rejected;
  return sum;
}

namespace {

/// Places the frames within a span by its odometry, and stops using their observations.
void place_within(const OdometrySpan& span, SceneMap& map) {
  Bundle& bundle = map.problem.bundle;
  std::vector<char> within(bundle.poses.size(), 0);
  for (std::size_t i = span.first; i < span.last; ++i) {
    const RelativeTerm& step = term_of(map, i);
    const SE3& S = step.factor.body_T_sensor;
    bundle.poses[step.b].value = bundle.poses[step.a].value * (S * step.factor.measured * S.inverse());
    within[step.b] = 1;
  }
  for (CornerTerm& term : bundle.corners)
    term.used = term.used && within[term.rig] == 0 && within[term.body] == 0;
}

}  // namespace

void restore_contradicted_frames(SceneMap& map) {
  const std::vector<OdometrySpan> spans = odometry_spans(map);
  const std::vector<double> chi2 = chi2_of_spans(map, spans);
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const bool follows = i > 0 && term_of(map, spans[i - 1].last).b == term_of(map, spans[i].first).a;
    if (!follows) before.reset();
    if (chi2[i] <= kOdometryGate) continue;
    if (before) {
      const OdometrySpan whole{spans[*before].first, spans[i].last};
      const RelativeTerm term = joined(map, whole);
      const RelativeTerm first = joined(map, spans[*before]);
      const Vector6 off = first.factor.whitening.inverse() * misfit_of(map.problem.bundle, first).r;
      const bool larger_than_noise = (term.factor.whitening * off).squaredNorm() > kOdometryGate;
      if (larger_than_noise && misfit_of(map.problem.bundle, term).r.squaredNorm() <= kOdometryGate) {
        place_within(whole, map);
        before.reset();
        continue;
      }
    }
    before = i;
  }
}

bool gate_odometry(SceneMap& map) {
  const std::vector<OdometrySpan> spans = odometry_spans(map);
  const std::vector<double> chi2 = chi2_of_spans(map, spans);
  bool changed = false;
  std::vector<std::size_t> bad;
  ImageGroups groups(map);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (!(chi2[i] <= kOdometryGate)) {
      bad.push_back(i);
      continue;
    }
    changed = set_used(map, spans[i], true) || changed;
    const RelativeTerm term = joined(map, spans[i]);
    groups.join(term.a, term.b);
  }
  std::ranges::stable_sort(bad, {}, [&](std::size_t i) { return chi2[i]; });
  for (const std::size_t i : bad) {
    const RelativeTerm term = joined(map, spans[i]);
    const bool alone = groups.of(term.a) != groups.of(term.b);
    changed = set_used(map, spans[i], alone) || changed;
    groups.join(term.a, term.b);
  }
  return changed;
}

namespace {

/// Rejected spans; those that follow each other are joined.
std::vector<OdometrySpan> rejected_spans(const SceneMap& map) {
  std::vector<OdometrySpan> rejected;
  for (const OdometrySpan& span : odometry_spans(map)) {
    if (joined(map, span).used) continue;
    const bool follows = !rejected.empty() && rejected.back().last + 1 == span.first &&
                         term_of(map, rejected.back().last).b == term_of(map, span.first).a;
    if (follows)
      rejected.back().last = span.last;
    else
      rejected.push_back(span);
  }
  return rejected;
}

void list_rejected_odometry(const SceneRecording& recording, SceneMap& map) {
  const auto time_s = [&](std::size_t frame) {
    return to_seconds(recording.frames[frame].stamp - recording.frames.front().stamp);
  };
  std::map<PoseIndex, std::size_t> body_of;
  for (std::size_t b = 0; b < map.problem.bodies.size(); ++b) {
    for (const PoseIndex pose : map.problem.bodies[b]) body_of[pose] = b;
  }
  for (const OdometrySpan& span : rejected_spans(map)) {
    const RelativeTerm term = joined(map, span);
    const std::vector<BundlePose>& poses = map.problem.bundle.poses;
    const SE3 off = term.factor.measured.inverse() * (poses[term.a].value.inverse() * poses[term.b].value);
    map.rejected_odometry.push_back({body_of[term.a], time_s(map.problem.odometry[span.first].from),
                                     time_s(map.problem.odometry[span.last].to), off.translation().norm(),
                                     off.rotation().log().norm(),
                                     misfit_of(map.problem.bundle, term).r.squaredNorm()});
  }
  std::ranges::stable_sort(map.rejected_odometry, std::greater<>{}, &RejectedOdometry::chi2);
}

/// Tags in use by their group.
std::map<std::size_t, std::vector<TagId>> tags_by_group(const SceneMap& map, ImageGroups& groups) {
  std::vector<char> used(map.problem.bundle.poses.size(), 0);
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.used) used[term.tag] = 1;
  }
  std::map<std::size_t, std::vector<TagId>> tags;
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    for (std::size_t t = 0; t < map.scene.bodies[b].tags.size(); ++t) {
      const PoseIndex pose = map.problem.tags[b][t];
      if (map.placed[pose] != 0 && used[pose] != 0)
        tags[groups.of(pose)].push_back(map.scene.bodies[b].tags[t].id);
    }
  }
  return tags;
}

/// Lists the groups without the map frame or, if it has no tags, all but the largest one.
void list_odometry_links(SceneMap& map) {
  ImageGroups groups(map);
  std::map<std::size_t, std::vector<TagId>> tags = tags_by_group(map, groups);
  if (tags.size() < 2) return;
  const auto by_size = [](const auto& group) { return group.second.size(); };
  if (tags.erase(groups.of(groups.map_frame())) == 0) tags.erase(std::ranges::max_element(tags, {}, by_size));
  std::map<std::size_t, OdometryLink> links;
  for (const OdometrySpan& span : odometry_spans(map)) {
    const RelativeTerm term = joined(map, span);
    if (!term.used || groups.of(term.a) == groups.of(term.b)) continue;
    OdometryLink link{.frames = static_cast<int>(span.last - span.first) + 1};
    for (std::size_t i = span.first; i <= span.last; ++i)
      link.length_m += term_of(map, i).factor.measured.translation().norm();
    for (const std::size_t group : {groups.of(term.a), groups.of(term.b)}) {
      const auto [it, fresh] = links.try_emplace(group, link);
      if (link.length_m < it->second.length_m) it->second = link;
    }
  }
  for (auto& [group, ids] : tags) {
    const auto link = links.find(group);
    if (link == links.end()) continue;
    link->second.beyond = std::move(ids);
    std::ranges::sort(link->second.beyond);
    map.odometry_links.push_back(link->second);
  }
  std::ranges::stable_sort(map.odometry_links, [](const OdometryLink& a, const OdometryLink& b) {
    return a.beyond.size() != b.beyond.size() ? a.beyond.size() > b.beyond.size() : a.beyond < b.beyond;
  });
}

}  // namespace

void report_odometry(const SceneRecording& recording, SceneMap& map) {
  if (!has_odometry(map)) return;
  list_rejected_odometry(recording, map);
  list_odometry_links(map);
}

}  // namespace waymark
