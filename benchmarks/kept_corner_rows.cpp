// Errors of corners that could not be refined, and what their covariance is computed from, one row per tag.
// tools/learn_kept_corners.py learns the weights of the covariance from them. usage: kept_corner_rows FILE
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "tests/support/kept_tags.hpp"
#include "waymark/tags/refinement/kept_corners.hpp"

int main(int count, char** words) {
  using namespace waymark;
  constexpr std::uint64_t kSeed = 1001;
  constexpr std::size_t kTimesMore = 12;
  if (count != 2) {
    std::cerr << "usage: kept_corner_rows FILE\n";
    return 2;
  }
  std::ofstream file(words[1]);
  for (const testing::KeptSet& set : testing::kept_sets()) {
    for (const testing::Kept& kept : testing::kept_tags(set.name, kTimesMore * set.images, kSeed)) {
      const bool is_placed = kept.corners.outcome != RefinementOutcome::CutByBorder &&
                             !kept.print.saturated && enough_steps(kept.steps);
      if (!is_placed) continue;
      Eigen::Matrix<double, 8, 1> shift_px;
      for (std::size_t k = 0; k < 4; ++k)
        shift_px.segment<2>(2 * static_cast<Eigen::Index>(k)) = kept.steps.shift_px[k];
      const Eigen::Map<const Eigen::Matrix<double, 1, 64>> covariance(kept.steps.covariance_px2.data());
      file << static_cast<int>(refinement::kept_cause(kept.corners.outcome, kept.steps)) << " "
           << kept.steps.share << " " << (kept.detected + shift_px).transpose() << " " << shift_px.transpose()
           << " " << covariance << "\n";
    }
  }
  return file.good() ? EXIT_SUCCESS : EXIT_FAILURE;
}
