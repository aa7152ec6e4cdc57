#include "waymark/mapping/scene/scene_contradictions.hpp"

#include <algorithm>
#include <any>
#include <cstddef>
#include <optional>
#include <utility>

#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/prior_checks.hpp"
#include "waymark/mapping/scene/scene_sizes.hpp"
#include "waymark/mapping/scene/vacated_places.hpp"
#include "waymark/mapping/solver/contradictions.hpp"

namespace waymark::internal {
namespace {

class SearchedScene final : public SearchedMap {
 public:
  SearchedScene(SceneSearch& search, std::vector<IdPlaces>& duplicates)
      : search_(search),
        map_(search.map()),
        times_(times_of(search.recording(), search.map().observations)),
        duplicates_(duplicates) {}

  Bundle& bundle() override { return search_.bundle(); }
  [[nodiscard]] const std::vector<char>& placed() const override { return map_.placed; }
  [[nodiscard]] const ObservationTimes& times() const override { return times_; }
  std::vector<SeparatedTag>& moves() override { return moves_; }

  [[nodiscard]] std::any state() const override { return search_.state(); }
  void go_to(std::any state) override {
    search_.go_to(std::any_cast<SceneSearch::State&&>(std::move(state)));
  }

  [[nodiscard]] bool goes_on() const override { return search_.goes_on(); }
  [[nodiscard]] bool is_stopped() const override { return map_.summary.stopped; }
  void find(double chi2) override {
    search_.find(chi2, search_.options().search.max_iterations, "explaining contradictions",
                 SceneSearch::kRoughGain);
  }
  void adjust() override { search_.adjust_until_stable(); }
  void gate() override { search_.gate_observations(); }
  [[nodiscard]] double noise() const override { return search_.noise_px(); }
  void set_noise(double noise) override { search_.set_corner_noise(noise); }
  [[nodiscard]] std::vector<double> chi2() const override { return corner_chi2(search_.bundle()); }
  [[nodiscard]] double robust_chi2() const override { return search_.options().search.robust_chi2; }
  [[nodiscard]] double outlier_chi2() const override {
    return search_.options().search.outlier_chi2 / map_.correlated_frames;
  }

  [[nodiscard]] std::vector<std::size_t> suspects() override {
    const std::vector<char> fit = sizes_that_fit(bundle(), chi2(), observations_by_size(map_));
    std::vector<std::size_t> unfit;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      if (fit[i] == 0) unfit.push_back(i);
    }
    std::vector<std::size_t> sizes = contradicted_sizes(map_);
    for (const std::size_t size : sizes_far_from_given_pose(map_)) sizes.push_back(size);
    for (const std::size_t size : sizes_of_moved_tags(bundle(), map_.placed, times_, unfit))
      sizes.push_back(size);
    for (const std::size_t size : sizes_at_several_places(fit)) sizes.push_back(size);
    return sizes;
  }
  /// A move of a duplicate tag that is not in the map would be reported as one of the tag that is.
  [[nodiscard]] bool may_have_moved(std::size_t size) const override {
    return std::ranges::none_of(duplicates_, [&](const IdPlaces& id) {
      return std::any_of(id.places.begin() + 1, id.places.end(),
                         [&](const IdPlace& place) { return place.size == size; });
    });
  }
  /// A tag was moved far if it had left one place while it was observed at the other one.
  [[nodiscard]] bool are_of_one_tag(const SeparatedTag& tag, double distance_m) const override {
    return distance_m < kMaxMoved_m || was_vacated(tag);
  }
  SeparatedTag separate(const LikelyMove& move) override { return separate_earlier(map_, times_, move); }
  void join(const SeparatedTag& tag) override { join_again(bundle(), tag); }
  void start_released(std::size_t size) override {
    if (observations_by_size(map_)[size].contradict()) start_size(map_, size);
  }
  void reinitialise() override { search_.replace_contradicted(search_.options().search.outlier_chi2); }

  /// A tag may also have a wrong given pose, or another tag has its id.
  void add_explanations(ContradictionSearch& search, std::size_t size, const std::function<void()>& go_back,
                        std::vector<Explanation>& explanations) override {
    go_back();
    if (auto loosened = explain_by_prior(search, size)) explanations.push_back(std::move(*loosened));
    go_back();
    const std::optional<IdPlaces> id = find_duplicate(search, size);
    if (!id) return;
    if (are_proven_two(map_, *id))
      std::erase_if(explanations, [](const Explanation& other) { return other.move.has_value(); });
    Explanation duplicate = search.explanation(6.0 * static_cast<double>(id->places.size() - 1));
    duplicate.accept = [this, id] { duplicates_.push_back(*id); };
    explanations.push_back(std::move(duplicate));
  }

  /// A given pose that two other ones refute stays without weight. Which of two given poses is wrong is not
  /// known, so both are used again.
  void end_attempts() override {
    bool restored = false;
    for (const auto& [prior, given] : loosened_priors_) {
      PriorTerm& term = bundle().priors[prior];
      if (other_given_tags(term.pose) >= 2) {
        map_.rejected_priors.push_back(term.pose);
        continue;
      }
      term.factor = given;
      restored = true;
    }
    if (restored) search_.adjust_until_stable();
  }

 private:
  [[nodiscard]] IdPlace place_at(PoseIndex pose) const {
    IdPlace place{.pose = pose};
    const std::vector<CornerTerm>& corners = map_.problem.bundle.corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (corners[i].tag == pose) place.terms.push_back(i);
    }
    return place;
  }

  /// The number of other tags on the same body whose observations agree with their given pose.
  [[nodiscard]] std::ptrdiff_t other_given_tags(PoseIndex tag) const {
    const Bundle& bundle = map_.problem.bundle;
    const auto body_of = [&](PoseIndex pose) -> std::optional<PoseIndex> {
      const auto term = std::ranges::find_if(
          bundle.corners, [&](const CornerTerm& corner) { return corner.tag == pose && corner.used; });
      return term == bundle.corners.end() ? std::nullopt : std::optional(term->body);
    };
    const auto is_loosened = [&](PoseIndex pose) {
      return std::ranges::any_of(
          loosened_priors_, [&](const auto& loosened) { return bundle.priors[loosened.first].pose == pose; });
    };
    return std::ranges::count_if(bundle.priors, [&](const PriorTerm& prior) {
      return !is_loosened(prior.pose) && body_of(prior.pose) && body_of(prior.pose) == body_of(tag);
    });
  }

  [[nodiscard]] bool was_vacated(const SeparatedTag& tag) const {
    const IdPlace earlier = place_at(tag.earlier);
    const IdPlace later = place_at(tag.later);
    if (earlier.terms.empty() || later.terms.empty()) return false;
    const SceneObservation& seen = map_.observations.seen[later.terms.front()];
    return waymark::was_vacated(map_, times_, {.body = seen.body, .tag = seen.tag}, earlier, later);
  }

  /// Tags that do not fit like others, and whose rejected observations agree on another place.
  [[nodiscard]] std::vector<std::size_t> sizes_at_several_places(const std::vector<char>& fit) const {
    constexpr std::ptrdiff_t kMinRejected = 4;
    const std::vector<SizeObservations> observations = observations_by_size(map_);
    const std::vector<CornerTerm>& corners = map_.problem.bundle.corners;
    std::vector<std::size_t> sizes;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      if (fit[i] != 0 || observations[i].rejected + observations[i].unconfirmed < kMinRejected) continue;
      const std::optional<IdPlaces> id = places_of_size(map_, i);
      const bool elsewhere = id && std::ranges::any_of(id->places, [&](const IdPlace& place) {
                               const auto used = std::ranges::count_if(
                                   place.terms, [&](std::size_t term) { return corners[term].used; });
                               return std::ssize(place.terms) - used >= std::max(kMinRejected, used);
                             });
      if (elsewhere) sizes.push_back(i);
    }
    return are_few_tags(sizes.size(), observations) ? sizes : std::vector<std::size_t>();
  }

  std::optional<Explanation> explain_by_prior(ContradictionSearch& search, std::size_t size) {
    constexpr double kLoosened = 1e-3;
    std::vector<PriorTerm>& priors = map_.problem.bundle.priors;
    const std::vector<CornerTerm>& corners = map_.problem.bundle.corners;
    const auto seen = std::ranges::find(corners, std::optional(size), &CornerTerm::size);
    if (seen == corners.end()) return std::nullopt;
    const auto prior = std::ranges::find(priors, seen->tag, &PriorTerm::pose);
    if (prior == priors.end()) return std::nullopt;
    const std::pair given(static_cast<std::size_t>(prior - priors.begin()), prior->factor);
    prior->factor.whitening = kLoosened * Matrix6::Identity();
    search.use_again({size});
    if (!search.may_fit(size)) return std::nullopt;
    search_.adjust_until_stable();
    if (!search_.goes_on() || !search.fits(size)) return std::nullopt;
    Explanation loosened = search.explanation(6);
    loosened.accept = [this, given] { loosened_priors_.push_back(given); };
    return loosened;
  }

  /// Adjusts the map with the places of the tag with this size, if they explain its observations.
  std::optional<IdPlaces> find_duplicate(ContradictionSearch& search, std::size_t size) {
    std::optional<IdPlaces> id = places_of_size(map_, size);
    const auto is_same = [&](const IdPlaces& other) {
      return other.body == id->body && other.tag == id->tag;
    };
    if (!id || std::ranges::any_of(duplicates_, is_same) ||
        std::ranges::any_of(moves_, [&](const SeparatedTag& tag) { return tag.move.size == size; }))
      return std::nullopt;
    separate_places(map_, *id);
    std::vector<std::size_t> sizes;
    for (const IdPlace& place : id->places) sizes.push_back(place.size);
    search.use_again(sizes);
    assign_to_places(map_, *id);
    const auto fits = [&](const IdPlace& place) {
      return search.may_fit(place.size) && search.fits(place.size);
    };
    if (!adjust_places(*id) || !std::ranges::all_of(id->places, fits)) return std::nullopt;
    return id;
  }

  /// Adjusts the map, and joins places that are not those of another tag with the first one, because a few
  /// wrong observations may agree by chance. Returns whether at least two places remain.
  bool adjust_places(IdPlaces& id) {
    std::size_t all = 0;
    do {
      search_.adjust_until_stable();
      if (!search_.goes_on()) return false;
      const std::vector<double> separations = separations_of(map_, {id}).front();
      all = id.places.size();
      for (std::size_t i = all; i-- > 1;) {
        if (identity_of(map_, times_, id, i, separations[i]) != TagIdentity::TwoTags)
          join_with_first(bundle(), i, id);
      }
    } while (id.places.size() < all && id.places.size() > 1);
    return id.places.size() > 1;
  }

  SceneSearch& search_;
  SceneMap& map_;
  ObservationTimes times_{};
  std::vector<SeparatedTag> moves_{};
  std::vector<IdPlaces>& duplicates_;
  std::vector<std::pair<std::size_t, PosePriorFactor>> loosened_priors_{};  ///< index and given factor
};

}  // namespace

std::vector<SeparatedTag> explain_contradictions(SceneSearch& search, std::vector<IdPlaces>& duplicates) {
  SceneMap& map = search.map();
  if (!search.goes_on()) return {};
  search.count_correlated();
  SearchedScene searched(search, duplicates);
  const ReleasedSizes sizes = ContradictionSearch(searched).explain(map.assumed_size_spread);
  map.released_sizes = sizes.released;
  map.size_spread = sizes.spread;
  return searched.moves();
}

}  // namespace waymark::internal
