#include "waymark/mapping/lap/chain_islands.hpp"

#include <algorithm>
#include <map>
#include <optional>

namespace waymark::internal {
namespace {

constexpr double kGate3 = 16.3;  // 0.999 quantile of chi-square with 3 degrees of freedom
constexpr double kGate6 = 22.5;  // with 6: one shape and a motion of the plane

/// Tags that links tie to each other.
struct Island {
  Links links{};
  std::map<TagId, int> seen{};        ///< its tags: in how many frames
  std::vector<std::size_t> frames{};  ///< that see some of them
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

  /// The one a tag is of, once; nothing where its tags are placed.
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

class Carrier {
 public:
  Carrier(const std::vector<FloorFrame>& frames, const OdometryTrack& wheels, const Eigen::Matrix3d& noise,
          bool spread, Places& places)
      : frames_(frames), noise_(noise), spread_(spread), places_(places), map_X_base_(frames.size()) {
    for (const FloorFrame& frame : frames) odom_X_base_.push_back(wheels.at(frame.stamp));
    for (std::size_t f = 0; f < frames.size(); ++f) map_X_base_[f] = base_by(places, f);
  }

  /// Along the frames in this order, from each that is placed to the next.
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

  /// Where an island lies that the wheels reach from a frame that is placed.
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

  /// What the frames of an island that are nearest agree on.
  [[nodiscard]] std::optional<SE2> carried(const Island& island, const Places& here, std::size_t from) const {
    constexpr std::size_t kFrames = 15;
    constexpr int kFewest = 4;
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
    if (!agreed || agreed->votes < std::max(kFewest, static_cast<int>(votes.size()) / 2)) return std::nullopt;
    return agreed->value.mean;
  }

  /// Of a motion that is uncertain where the base is.
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
  Carrier carrier(frames, wheels, noise, spread_closing_errors, places);
  std::vector<std::size_t> order(frames.size());
  for (std::size_t f = 0; f < order.size(); ++f) order[f] = f;
  carrier.run(order, islands);
  std::ranges::reverse(order);
  carrier.run(order, islands);
}

}  // namespace waymark::internal
