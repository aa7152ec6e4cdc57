#include "waymark/mapping/lap/lap_contradictions.hpp"

#include <algorithm>
#include <any>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "waymark/mapping/lap/noise.hpp"
#include "waymark/mapping/solver/contradictions.hpp"

namespace waymark::internal {
namespace {

ObservationTimes times_of(const LapInput& input, const LapBundle& lap) {
  ObservationTimes times;
  times.frames.reserve(lap.observations.size());
  for (const LapBundle::Observation& seen : lap.observations) times.frames.push_back(seen.frame);
  times.frame_s.reserve(input.frames.size());
  for (const TagFrame& frame : input.frames)
    times.frame_s.push_back(to_seconds(frame.stamp - input.frames.front().stamp));
  return times;
}

/// The sizes of tags that contradict the map, and of those that may have been moved. All tags are tried: if
/// one was moved late, few of its observations contradict the map.
std::vector<std::size_t> contradicted(const Bundle& bundle, const ObservationTimes& times) {
  std::vector<std::size_t> sizes = contradicted_sizes(observations_by_size(bundle));
  std::vector<std::size_t> all(bundle.sizes.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (const std::size_t size : sizes_of_moved_tags(bundle, {}, times, all)) sizes.push_back(size);
  return sizes;
}

void join_moved_tag(const SeparatedTag& tag, LapBundle& lap) {
  join_again(lap.bundle, tag);
  if (lap.anchor == tag.earlier) lap.anchor = tag.later;
}

class SearchedLap final : public SearchedMap {
  struct State {
    LapBundle lap{};
    double noise_ratio = 1;
    BundleSummary summary{};
  };

 public:
  SearchedLap(const LapInput& input, LapBundle& lap, const LapSearchSteps& steps)
      : lap_(lap), steps_(steps), times_(times_of(input, lap)) {}

  Bundle& bundle() override { return lap_.bundle; }
  [[nodiscard]] const std::vector<char>& placed() const override { return all_placed_; }
  [[nodiscard]] const ObservationTimes& times() const override { return times_; }
  std::vector<SeparatedTag>& moves() override { return moves_; }

  [[nodiscard]] std::any state() const override { return State{lap_, steps_.noise_ratio, steps_.summary}; }
  void go_to(std::any state) override {
    auto& to = std::any_cast<State&>(state);
    lap_ = std::move(to.lap);
    steps_.noise_ratio = to.noise_ratio;
    if (!steps_.summary.stopped) steps_.summary = std::move(to.summary);
  }

  [[nodiscard]] bool goes_on() const override { return steps_.summary.usable(); }
  [[nodiscard]] bool is_stopped() const override { return steps_.summary.stopped; }
  void find(double robust_chi2) override { steps_.find(robust_chi2); }
  void adjust() override { steps_.adjust(); }
  void gate() override { steps_.gate(); }
  [[nodiscard]] double noise() const override { return steps_.noise_ratio; }
  void set_noise(double noise) override {
    scale_noise(lap_.bundle, noise / steps_.noise_ratio);
    steps_.noise_ratio = noise;
  }
  [[nodiscard]] std::vector<double> chi2() const override { return corner_chi2(lap_.bundle); }
  [[nodiscard]] double robust_chi2() const override { return steps_.robust_chi2; }
  [[nodiscard]] double outlier_chi2() const override { return steps_.outlier_chi2; }

  [[nodiscard]] std::vector<std::size_t> suspects() override { return contradicted(lap_.bundle, times_); }
  SeparatedTag separate(const LikelyMove& move) override {
    const SeparatedTag tag = separate_earlier(lap_.bundle, all_placed_, times_, move);
    if (lap_.anchor == tag.later) lap_.anchor = tag.earlier;
    return tag;
  }
  void join(const SeparatedTag& tag) override { join_moved_tag(tag, lap_); }

 private:
  LapBundle& lap_;
  const LapSearchSteps& steps_;
  ObservationTimes times_{};
  std::vector<SeparatedTag> moves_{};
  std::vector<char> all_placed_{};  ///< empty: all poses are placed
};

/// The tag whose later pose this is.
TagId tag_of(const LapBundle& lap, PoseIndex later) {
  return std::ranges::find(lap.tags, later, [](const auto& tag) { return tag.second; })->first;
}

}  // namespace

ReleasedSizes explain_contradictions(const LapInput& input, LapBundle& lap, double assumed_sigma,
                                     const LapSearchSteps& steps) {
  SearchedLap map(input, lap, steps);
  ReleasedSizes sizes = ContradictionSearch(map).explain(assumed_sigma);
  lap.moves = map.moves();
  return sizes;
}

void join_moved_tags(LapBundle& lap) {
  for (const SeparatedTag& tag : lap.moves) join_moved_tag(tag, lap);
  lap.moves.clear();
}

bool has_contradictions(const LapInput& input, const LapBundle& lap) {
  return !contradicted(lap.bundle, times_of(input, lap)).empty();
}

std::vector<MovedTag> moved_tags(const LapInput& input, const LapBundle& lap, const TagMap& map) {
  const ObservationTimes times = times_of(input, lap);
  std::vector<MovedTag> moved;
  for (const SeparatedTag& tag : lap.moves) {
    MovedTag found = describe_move(lap.bundle, times, tag, tag_of(lap, tag.later));
    found.earlier.reset();  // the bundle is not kept
    if (is_far(found) && map.find(found.tag) != nullptr) moved.push_back(found);
  }
  return moved;
}

}  // namespace waymark::internal
