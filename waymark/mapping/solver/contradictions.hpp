#pragma once

#include <any>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "waymark/mapping/solver/tag_moves.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

/// Search for what explains the tags that contradict a map: another printed size, a move during the
/// recording, or a cause that only one kind of map has.
namespace waymark {

class ContradictionSearch;

/// What may explain the contradictions of one tag, with the map that it leads to.
struct Explanation {
  std::any state{};  ///< SearchedMap::state()
  double noise = 1;  ///< SearchedMap::noise()
  double more_unknowns = 0;
  SizeCause cause = SizeCause::Other;  ///< Unknown: the map as it was before
  std::optional<SeparatedTag> move{};
  std::function<void()> accept{};  ///< called if it is the most likely one, after the map has its state
};

/// A map whose search can be continued, repeated and undone. Laps and scenes implement it.
class SearchedMap {
 public:
  SearchedMap() = default;
  SearchedMap(const SearchedMap&) = delete;
  SearchedMap& operator=(const SearchedMap&) = delete;
  SearchedMap(SearchedMap&&) = delete;
  SearchedMap& operator=(SearchedMap&&) = delete;
  virtual ~SearchedMap() = default;

  virtual Bundle& bundle() = 0;
  /// Whether each pose of the bundle is placed; if it is empty, all are.
  [[nodiscard]] virtual const std::vector<char>& placed() const = 0;
  [[nodiscard]] virtual const ObservationTimes& times() const = 0;
  /// The tags that were moved. The search adds to them.
  virtual std::vector<SeparatedTag>& moves() = 0;

  /// A copy of everything that the search changes, except for moves().
  [[nodiscard]] virtual std::any state() const = 0;
  virtual void go_to(std::any state) = 0;

  /// Whether the last search succeeded and was not stopped.
  [[nodiscard]] virtual bool goes_on() const = 0;
  [[nodiscard]] virtual bool is_stopped() const = 0;
  /// Minimises the cost with a robust loss.
  virtual void find(double robust_chi2) = 0;
  /// Estimates the noise and rejects outliers until neither changes.
  virtual void adjust() = 0;
  /// Rejects outliers at the present poses and noise.
  virtual void gate() = 0;
  /// The standard deviation of corners, in any unit.
  [[nodiscard]] virtual double noise() const = 0;
  virtual void set_noise(double noise) = 0;
  /// The chi2 of each corner term.
  [[nodiscard]] virtual std::vector<double> chi2() const = 0;
  [[nodiscard]] virtual double robust_chi2() const = 0;
  [[nodiscard]] virtual double outlier_chi2() const = 0;  ///< of chi2() beyond which gate() rejects

  /// The sizes of tags that may contradict the map, those to be tried first at the front.
  [[nodiscard]] virtual std::vector<std::size_t> suspects() = 0;
  /// Whether a move of the tag with this size can be reported.
  [[nodiscard]] virtual bool may_have_moved(std::size_t /*size*/) const { return true; }
  /// Whether one tag was moved from one of these poses to the other one, this far. Otherwise, two tags carry
  /// its id, or it was misread.
  [[nodiscard]] virtual bool are_of_one_tag(const SeparatedTag& /*tag*/, double distance_m) const {
    return distance_m < kMaxMoved_m;
  }
  /// Gives the observations before a move a pose of their own, or joins the two poses again.
  virtual SeparatedTag separate(const LikelyMove& move) = 0;
  virtual void join(const SeparatedTag& tag) = 0;
  /// Chooses initial values for a size that was just released.
  virtual void start_released(std::size_t /*size*/) {}
  /// Moves poses that contradict the observations in use to better initial values.
  virtual void reinitialise() {}
  /// Adds the explanations that only this kind of map has. `go_back` restores the map before the search for
  /// an explanation.
  virtual void add_explanations(ContradictionSearch& /*search*/, std::size_t /*size*/,
                                const std::function<void()>& /*go_back*/,
                                std::vector<Explanation>& /*explanations*/) {}
  /// Undoes what only attempts need, after the last one.
  virtual void end_attempts() {}
};

/// Tries the explanations of one tag after the other. By the criterion of Schwarz ("Estimating the Dimension
/// of a Model", Annals of Statistics 6(2), 1978), the most likely one is kept, or the map as it was.
class ContradictionSearch {
 public:
  explicit ContradictionSearch(SearchedMap& map) : map_(map) {}

  /// Finds the sizes that contradict the observations, the spread of the others, and the tags that were
  /// moved. `assumed_sigma`: standard deviation of sizes; if it is 0, sizes are exact, and only other
  /// explanations are tried.
  ReleasedSizes explain(double assumed_sigma);

  // Steps of an attempt.

  /// Uses all observations of these tags again. Errors are large at first, so the outlier threshold is
  /// decreased in steps.
  void use_again(const std::vector<std::size_t>& sizes);
  /// Whether few enough observations of a tag contradict the map for the attempt to go on.
  [[nodiscard]] bool may_fit(std::size_t size);
  /// Whether the observations of a tag agree with the map as well as those of other tags.
  [[nodiscard]] bool fits(std::size_t size) const;
  /// An explanation with the map as it is now.
  [[nodiscard]] Explanation explanation(double more_unknowns) const;

 private:
  ReleasedSizes explain_by_sizes(double assumed_sigma);
  void explain_exact_sizes();
  SizeCause cause_of(std::size_t size, const std::any& before);
  std::optional<Explanation> explain_by_move(const LikelyMove& move);
  Explanation move_among_neighbours(Explanation found, const std::any& before);
  Explanation best_of(std::vector<Explanation> explanations, std::size_t size);
  void join_unmoved_tags();

  SearchedMap& map_;
};

/// Of the tags with these sizes, those that would fit better if they had been moved. Empty unless these are
/// few tags.
[[nodiscard]] std::vector<std::size_t> sizes_of_moved_tags(const Bundle& bundle,
                                                           const std::vector<char>& placed,
                                                           const ObservationTimes& times,
                                                           const std::vector<std::size_t>& sizes);

}  // namespace waymark
