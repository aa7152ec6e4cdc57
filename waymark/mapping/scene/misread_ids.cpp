#include "waymark/mapping/scene/misread_ids.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace waymark {
namespace {

// Nearby tags are searched for in this many views before and after.
constexpr std::size_t kNeighbourViews = 10;
constexpr double kMinOldRatio = 100;   // chi2 with the id as read, as a multiple of the outlier gate
constexpr double kMaxNewRatio = 4;     // chi2 with the new id; it is gated again once poses have moved
constexpr double kMinNextRatio = 100;  // chi2 with the next best id

/// A tag that an observation may actually show, with the best order of its corners.
struct Candidate {
  std::size_t like = 0;  ///< an observation of this tag
  CornerFactor factor{};
  double chi2 = std::numeric_limits<double>::infinity();
};

class Corrector {
 public:
  Corrector(SceneMap& map, double outlier_chi2) : map_(map), gate_(outlier_chi2) {
    const std::vector<SceneObservation>& seen = map.observations.seen;
    views_.resize(map.scene.cameras.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      auto& of_camera = views_[seen[i].camera];
      if (of_camera.size() <= seen[i].frame) of_camera.resize(seen[i].frame + 1);
      of_camera[seen[i].frame].push_back(i);
    }
  }

  int run() {
    const std::vector<double> chi2 = corner_chi2(map_.problem.bundle);
    int corrected = 0;
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      if (terms()[i].used || !(chi2[i] > kMinOldRatio * gate_) || !has_consistent_neighbour(i)) continue;
      const std::optional<Candidate> found = only_candidate(i);
      if (!found) continue;
      correct(i, *found);
      ++corrected;
    }
    return corrected;
  }

 private:
  [[nodiscard]] std::vector<CornerTerm>& terms() const { return map_.problem.bundle.corners; }
  [[nodiscard]] const std::vector<std::size_t>& view_of(std::size_t i) const {
    const SceneObservation& seen = map_.observations.seen[i];
    return views_[seen.camera][seen.frame];
  }
  /// Whether the view contains an observation that is consistent with the map.
  [[nodiscard]] bool has_consistent_neighbour(std::size_t i) const {
    return std::ranges::any_of(view_of(i), [&](std::size_t other) {
      return terms()[other].used && terms()[other].body == terms()[i].body;
    });
  }

  /// One observation for each tag on the same body that is in use in nearby views and absent from this view.
  [[nodiscard]] std::vector<std::size_t> tags_around(std::size_t i) const {
    const SceneObservation& at = map_.observations.seen[i];
    const auto& views = views_[at.camera];
    std::vector<std::size_t> found;
    const std::size_t first = at.frame - std::min(at.frame, kNeighbourViews);
    const std::size_t last = std::min(views.size(), at.frame + kNeighbourViews + 1);
    for (std::size_t f = first; f < last; ++f) {
      for (std::size_t other : views[f]) {
        const SceneObservation& seen = map_.observations.seen[other];
        if (terms()[other].used && seen.body == at.body && seen.tag != at.tag) found.push_back(other);
      }
    }
    const auto tag = [&](std::size_t k) { return terms()[k].tag; };
    std::ranges::stable_sort(found, {}, tag);
    const auto repeated = std::ranges::unique(found, {}, tag);
    found.erase(repeated.begin(), repeated.end());
    std::erase_if(found, [&](std::size_t k) {
      return std::ranges::any_of(view_of(i), [&](std::size_t other) {
        return terms()[other].tag == terms()[k].tag && (other == i || terms()[other].used);
      });
    });
    return found;
  }

  [[nodiscard]] Candidate as_tag_of(std::size_t i, std::size_t like) const {
    const Bundle& bundle = map_.problem.bundle;
    const CornerTerm& term = bundle.corners[i];
    Candidate candidate{.like = like};
    CornerFactor turned = term.factor;
    turned.size_m = bundle.corners[like].factor.size_m;
    CornerPoses poses = poses_of(bundle, bundle.corners[like]);
    poses.map_T_rig = bundle.poses[term.rig].value;
    poses.rig_T_cam = bundle.poses[term.cam].value;
    poses.map_T_body = bundle.poses[term.body].value;
    for (int turn = 0; turn < 4; ++turn) {
      const auto r = corner_residual(turned, bundle.cameras[term.camera], poses);
      if (r && r->squaredNorm() < candidate.chi2) {
        candidate.chi2 = r->squaredNorm();
        candidate.factor = turned;
      }
      std::ranges::rotate(turned.corners_px, turned.corners_px.begin() + 1);
    }
    return candidate;
  }

  [[nodiscard]] std::optional<Candidate> only_candidate(std::size_t i) const {
    std::optional<Candidate> best;
    double next = std::numeric_limits<double>::infinity();
    for (std::size_t like : tags_around(i)) {
      Candidate candidate = as_tag_of(i, like);
      if (!best || candidate.chi2 < best->chi2) {
        if (best) next = std::min(next, best->chi2);
        best = std::move(candidate);
      } else {
        next = std::min(next, candidate.chi2);
      }
    }
    if (!best || !(best->chi2 < kMaxNewRatio * gate_) || next < kMinNextRatio * gate_) return std::nullopt;
    return best;
  }

  void correct(std::size_t i, const Candidate& found) {
    SceneObservation& seen = map_.observations.seen[i];
    const SceneObservation& like = map_.observations.seen[found.like];
    const std::vector<SceneTag>& tags = map_.scene.bodies[seen.body].tags;
    map_.corrected_ids.push_back({seen.frame, tags[seen.tag].id, tags[like.tag].id});
    seen.tag = like.tag;
    seen.factor.corners_px = found.factor.corners_px;
    seen.factor.size_m = found.factor.size_m;
    CornerTerm& term = terms()[i];
    term.factor = found.factor;
    term.tag = terms()[found.like].tag;
    term.size = terms()[found.like].size;
    term.used = true;
    term.unconfirmed = false;
  }

  SceneMap& map_;
  double gate_;
  std::vector<std::vector<std::vector<std::size_t>>> views_;  ///< observations for each camera and frame
};

}  // namespace

int correct_misread_ids(SceneMap& map, double outlier_chi2) { return Corrector(map, outlier_chi2).run(); }

}  // namespace waymark
