// The covariance of corners that could not be refined, for each cause, in images made to provoke the causes.
// The weights were learnt from images with another seed (benchmarks/kept_corner_rows.cpp).
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/corner_table.hpp"
#include "tests/support/kept_tags.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::Kept;

constexpr std::uint64_t kTestSeed = 2002;

/// Errors of the tags of one cause.
struct CauseScores {
  double tags = 0;
  double squares = 0;
  double detected = 0;
  double stated = 0;
  double nees = 0;
  int marked = 0;

  void add(const Kept& kept) {
    tags += 1;
    squares += kept.error.squaredNorm() / 8;
    detected += kept.detected.squaredNorm() / 8;
    stated += kept.corners.covariance_px2.trace() / 8;
    nees += kept.error.dot(kept.corners.covariance_px2.ldlt().solve(kept.error)) / 8;
    marked += kept.corners.state == CornerState::Unreliable ? 1 : 0;
  }
  void print(const std::string& name) const {
    std::cout << fmt::format("{:<16}{:>6}{:>10}{:>10.3f}{:>9.3f}{:>9.3f}{:>8.2f}\n", name, tags, marked,
                             std::sqrt(detected / tags), std::sqrt(squares / tags), std::sqrt(stated / tags),
                             nees / tags);
  }
};

TEST(KeptCorners, AreConsistentForEachCause) {
  std::map<std::string, CauseScores> causes;
  CauseScores all;
  int far = 0;
  for (const testing::KeptSet& set : testing::kept_sets()) {
    for (const Kept& kept : testing::kept_tags(set.name, set.images, kTestSeed)) {
      ASSERT_EQ(Eigen::LLT<CornerCovariance>(kept.corners.covariance_px2).info(), Eigen::Success);
      causes[kept.print.saturated ? "saturated" : std::string(to_string(kept.corners.outcome))].add(kept);
      all.add(kept);
      if (kept.corners.state == CornerState::Measured)
        far += testing::corners_far_off(kept.error, kept.corners.covariance_px2);
    }
  }
  std::cout
      << "cause             tags  unreliable  detected   kept   stated  NEES/8   (RMS per coordinate, px)\n";
  for (const auto& [name, scores] : causes) scores.print(name);
  all.print("all");
  std::cout << "far off: " << far << " of " << 4 * (all.tags - all.marked) << " corners, seed " << kTestSeed
            << "\n";
  for (const char* name : {"too_small", "low_contrast", "cut_by_border", "poor_fit", "moved_too_far"})
    EXPECT_GE(causes[name].tags, 5) << name;
  constexpr double kMinTags = 12;  // the mean of fewer is not tested
  for (const auto& [name, scores] : causes) {
    if (scores.tags < kMinTags) continue;
    // A cell of the border may be missing beyond that of the image (tests/plant/border_test.py).
    if (name != "cut_by_border") EXPECT_GT(scores.nees / scores.tags, 0.5) << name;
    EXPECT_LT(scores.nees / scores.tags, 2.0) << name;
  }
  EXPECT_LT(all.squares, 0.5 * all.detected) << "the steps between cells correct the detected corners";
  EXPECT_LE(far, 2);
}

}  // namespace
}  // namespace waymark
