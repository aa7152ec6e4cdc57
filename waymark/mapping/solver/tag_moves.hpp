#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"

/// Search for tags that were moved during a recording, and the criterion for explanations of contradictions.
/// `placed`: whether each pose of the bundle is placed; if it is empty, all are.
namespace waymark {

/// The times of the observations of a bundle.
struct ObservationTimes {
  std::vector<std::size_t> frames{};  ///< of each corner term
  std::vector<double> frame_s{};      ///< time of each frame since the first one, ascending
  double min_move_s = 0;              ///< the least time between two observations in which a tag is moved
};

/// A time between two observations of a tag, in which it may have been moved.
struct LikelyMove {
  std::size_t size = 0;                          ///< of the tag, an index into Bundle::sizes
  std::size_t last_before = 0, first_after = 0;  ///< frames
  double gap_s = 0;                              ///< between these frames
  double gain = 0;  ///< how much less the squared residuals are with two poses, to first order
};

/// For each tag with a size in `sizes`, the move that explains its observations best, with all other poses
/// held constant. It has at least four observations before and after it. Tags for which a second pose does
/// not explain enough are left out (Schwarz, "Estimating the Dimension of a Model", Annals of Statistics
/// 6(2), 1978). The best explained first. O(observations of these tags).
[[nodiscard]] std::vector<LikelyMove> likely_moves(const Bundle& bundle, const std::vector<char>& placed,
                                                   const ObservationTimes& times,
                                                   const std::vector<std::size_t>& sizes);

/// The moves of one tag that are worth trying: the two that could take longest, and the most likely one. The
/// most likely one is not always right, because images between two moves may follow the tag.
[[nodiscard]] std::vector<LikelyMove> moves_to_try(const Bundle& bundle, const std::vector<char>& placed,
                                                   const ObservationTimes& times, std::size_t size);

/// At the time of a move, one move of each of the tags that were most often observed together with the moved
/// one. One of them may be the tag that was moved.
[[nodiscard]] std::vector<LikelyMove> moves_of_neighbours(const Bundle& bundle,
                                                          const std::vector<char>& placed,
                                                          const ObservationTimes& times,
                                                          const LikelyMove& move);

/// A tag with a pose before and one after a move.
struct SeparatedTag {
  LikelyMove move{};
  PoseIndex earlier = 0, later = 0;
};

/// Gives the observations before a move a pose of their own, which is the last one of the bundle and placed.
/// What is given about the tag (pose, distances, coordinates, directions) applies to this pose. Both poses
/// start where most of their observations agree.
SeparatedTag separate_earlier(Bundle& bundle, std::vector<char>& placed, const ObservationTimes& times,
                              const LikelyMove& move);

/// Undoes separate_earlier(). The earlier pose remains, without observations.
void join_again(Bundle& bundle, const SeparatedTag& tag);

/// The distance and the angle between the two poses of a moved tag, and the time of the move.
[[nodiscard]] MovedTag describe_move(const Bundle& bundle, const ObservationTimes& times,
                                     const SeparatedTag& separated, const TagId& tag);

/// Whether the two poses of a tag differ by more than printing and corner errors explain: 5 mm or 0.02 rad.
[[nodiscard]] bool is_far(const MovedTag& moved);

/// Half the sum of squared residuals. Each rejected observation counts as half the limit `outlier_chi2`, if
/// it is placed and confirmed.
[[nodiscard]] double cost_with_rejected(const Bundle& bundle, const std::vector<char>& placed,
                                        double outlier_chi2);

/// The criterion of Schwarz for an explanation with this cost and this number of additional unknowns. The
/// smallest one is the most likely. `observations`: of the tag, with eight numbers each.
[[nodiscard]] double schwarz_criterion(double cost, double more_unknowns, std::ptrdiff_t observations);

}  // namespace waymark
