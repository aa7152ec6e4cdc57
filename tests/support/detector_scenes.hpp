#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/draw_tag.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark::testing {

inline std::unique_ptr<Detector> detector_with(const DetectorOptions& options = {}) {
  auto made = make_apriltag_detector(options);
  EXPECT_TRUE(made) << to_string(made.error());
  return std::move(made).value();
}

inline DetectorOptions options_for(FamilyId id, int max_hamming = 0) {
  DetectorOptions options;
  options.families = {std::string(to_string(id))};
  options.max_hamming = max_hamming;
  return options;
}

inline bool same(const std::vector<TagDetection>& a, const std::vector<TagDetection>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const TagDetection& x, const TagDetection& y) {
    return x.tag == y.tag && x.hamming == y.hamming && x.decision_margin == y.decision_margin &&
           x.corners_px == y.corners_px;
  });
}

/// Tags of several sizes and directions on grey, with noise.
inline Image tag_scene(int width, int height, std::uint64_t seed, int tags) {
  Image image(width, height, 140);
  Random random(seed);
  for (int i = 0; i < tags; ++i) {
    const double side = random.uniform(24, 60);
    const double y = random.uniform(60, height - 60);  // one draw per statement: the same on every compiler
    const Eigen::Vector2d center(random.uniform(60, width - 60), y);
    paint_tag(image, {FamilyId::Tag36h11, i}, square_corners(center, side, random.uniform(0, 6)));
  }
  add_noise(image, 2, random);
  return image;
}

}  // namespace waymark::testing
