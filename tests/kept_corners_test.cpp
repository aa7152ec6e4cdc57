// The covariance of corners that could not be refined, for each cause, in images made to provoke the causes.
// The weights were learnt from images with other seeds:
//
//     WAYMARK_KEPT_ROWS=rows.txt waymark_tags_tests --gtest_filter='KeptCorners.WriteRows'
//     tools/learn_kept_corners.py rows.txt
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/degraded_tags.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/refinement/cell_steps.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/refinement/kept_corners.hpp"

namespace waymark {
namespace {

using refinement::place_by_steps;
using refinement::PrintedTag;
using refinement::Quad;
using Vector8 = Eigen::Matrix<double, 8, 1>;

constexpr std::uint64_t kLearntSeed = 1001;
constexpr std::uint64_t kTestSeed = 2002;

/// Set names and numbers of images, about as many kept tags of each.
const std::vector<std::pair<std::string, std::size_t>> kImages = {
    {"tiny", 10}, {"faint", 24}, {"cut", 3},    {"covered", 5}, {"bent", 6},
    {"glare", 4}, {"moving", 6}, {"bright", 8}, {"bar", 2},     {"mixed", 3}};

Vector8 difference(const Quad& a, const Quad& b) {
  Vector8 error;
  for (std::size_t k = 0; k < 4; ++k) error.segment<2>(2 * static_cast<Eigen::Index>(k)) = a[k] - b[k];
  return error;
}

struct Kept {
  RefinedCorners corners;
  PrintedTag print;
  refinement::StepPlacement steps;
  Vector8 error;     ///< of the kept corners
  Vector8 detected;  ///< error of the detected corners
};

/// All tags of a set that are detected but not refined.
std::vector<Kept> kept_tags(const std::string& set, std::size_t images, std::uint64_t seed) {
  DetectorOptions options;
  options.max_hamming = 2;
  if (set == "faint") options.min_white_black_diff = 5;
  const auto detector = make_detector(options).value();
  std::vector<Kept> kept;
  for (std::size_t i = 0; i < images; ++i) {
    const testing::TagImage photo = testing::tag_image(set, i, seed);
    const auto tags = detector->detect(photo.image).value();
    for (const MatchedPair& pair : match_detections(tags, photo.truth).correct) {
      const TagDetection& tag = tags[pair.detection];
      const Quad& truth = photo.truth[pair.truth].corners_px;
      const RefinedCorners corners = refine_corners(photo.image, tag);
      if (corners.refined()) continue;
      const PrintedTag print = refinement::printed_tag(photo.image, tag.tag, tag.corners_px);
      kept.push_back({corners, print, place_by_steps(photo.image, print, tag.corners_px),
                      difference(corners.corners_px, truth), difference(tag.corners_px, truth)});
    }
  }
  return kept;
}

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

/// Number of corners that are both more than 5 standard deviations and more than 0.5 px off.
int far_corners(const Kept& kept) {
  constexpr double kSigmas = 5;
  constexpr double kLeastErrorPx = 0.5;
  int far = 0;
  for (Eigen::Index at = 0; at < 8; at += 2) {
    const Eigen::Vector2d error = kept.error.segment<2>(at);
    const Eigen::Matrix2d covariance = kept.corners.covariance_px2.block<2, 2>(at, at);
    const bool beyond =
        error.norm() > kLeastErrorPx && error.dot(covariance.llt().solve(error)) > kSigmas * kSigmas;
    far += beyond ? 1 : 0;
  }
  return far;
}

TEST(KeptCorners, AreConsistentForEachCause) {
  std::map<std::string, CauseScores> causes;
  CauseScores all;
  int far = 0;
  for (const auto& [set, images] : kImages) {
    for (const Kept& kept : kept_tags(set, images, kTestSeed)) {
      ASSERT_EQ(Eigen::LLT<CornerCovariance>(kept.corners.covariance_px2).info(), Eigen::Success);
      causes[kept.print.saturated ? "saturated" : std::string(to_string(kept.corners.outcome))].add(kept);
      all.add(kept);
      if (kept.corners.state == CornerState::Measured) far += far_corners(kept);
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

TEST(KeptCorners, WriteRows) {
  const char* path = std::getenv("WAYMARK_KEPT_ROWS");
  if (path == nullptr) GTEST_SKIP() << "set WAYMARK_KEPT_ROWS to a file";
  constexpr std::size_t kTimesMore = 5;
  std::ofstream file(path);
  for (const auto& [set, images] : kImages) {
    for (const Kept& kept : kept_tags(set, kTimesMore * images, kLearntSeed)) {
      if (kept.print.saturated || !enough_steps(kept.steps)) continue;
      const Vector8 shift = difference(kept.steps.shift_px, {});
      const Eigen::Map<const Eigen::Matrix<double, 1, 64>> covariance(kept.steps.covariance_px2.data());
      file << static_cast<int>(kept_cause(kept.corners.outcome, kept.steps)) << " " << kept.steps.share << " "
           << (kept.detected + shift).transpose() << " " << shift.transpose() << " " << covariance << "\n";
    }
  }
  EXPECT_TRUE(file.good());
}

}  // namespace
}  // namespace waymark
