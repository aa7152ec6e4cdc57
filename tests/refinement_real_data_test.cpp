// Refined corners on rendered images with exact ground truth, compared with those of libapriltag.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/corner_table.hpp"
#include "tests/support/data.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::CornerLine;

DetectionTruth read_truth(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  auto truth = parse_truth(text.str(), path.string());
  EXPECT_TRUE(truth) << to_string(truth.error());
  return truth.value_or(DetectionTruth{});
}

int size_class(double size_px) {
  for (const int top : {14, 18, 22, 28, 40, 64, 115}) {
    if (size_px < top) return top;
  }
  return 250;
}

struct Table {
  CornerLine all;
  std::map<int, CornerLine> by_size;  ///< by the upper end of the class
  std::map<int, CornerLine> by_tilt;
  std::map<std::string, int> outcomes;

  void print(const std::string& title) const {
    std::printf("%s\n", title.c_str());
    CornerLine::print_header();
    for (const auto& [top, line] : by_size) line.print("below " + std::to_string(top) + " px");
    for (const auto& [tilt, line] : by_tilt) line.print("tilt " + std::to_string(tilt) + " deg");
    all.print("all");
    for (const auto& [outcome, count] : outcomes) std::printf("%s %d  ", outcome.c_str(), count);
    std::printf("\n");
  }
};

Table measure(const std::filesystem::path& folder, double quad_decimate, const RefinementOptions& options) {
  DetectorOptions detector_options;
  detector_options.quad_decimate = quad_decimate;
  const auto detector = make_apriltag_detector(detector_options).value();
  Table table;
  for (const auto& [name, truth] : read_truth(folder / "truth.csv")) {
    const auto image = read_image(folder / (name + ".png"));
    EXPECT_TRUE(image) << to_string(image.error());
    const auto found = detector->detect(*image).value();
    for (const MatchedPair& pair : match_detections(found, truth).correct) {
      const TagDetection& raw = found[pair.detection];
      const TrueTag& tag = truth[pair.truth];
      const RefinedCorners result = refine_corners(*image, raw, options);
      ++table.outcomes[std::string(to_string(result.outcome))];
      if (!result.refined()) continue;
      for (CornerLine* line : {&table.all, &table.by_size[size_class(tag.size_px)],
                               &table.by_tilt[static_cast<int>(tag.tilt_deg.value_or(0) + 0.5)]}) {
        line->add(tag.corners_px, raw.corners_px, result.corners_px, result.covariance_px2);
      }
    }
  }
  return table;
}

void expect_better_than_half(const Table& table) {
  for (const auto& [top, line] : table.by_size) {
    if (top >= 28) {
      EXPECT_LT(line.rmse_px(), 0.5 * line.rmse_before_px()) << "below " << top << " px";
    }
    EXPECT_LT(line.rmse_px(), line.rmse_before_px()) << "below " << top << " px";
  }
  EXPECT_LT(table.all.bias_px().cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(std::abs(table.all.outward_px()), 0.01);
}

/// These images have neither gamma nor illumination gradients. Because the corners allow for them, the NEES
/// is lower here: the lower bounds include 0.05 to 0.1 for that. For the effects of real cameras see
/// refinement_conditions_test.cpp.
void expect_consistent(const Table& table, double low, double high) {
  EXPECT_GT(table.all.nees_tag(), 0.9);
  EXPECT_LT(table.all.nees_tag(), 1.1);
  EXPECT_GT(table.all.nees_corner(), 0.85);
  EXPECT_LT(table.all.nees_corner(), 1.1);
  for (const auto* classes : {&table.by_size, &table.by_tilt}) {
    for (const auto& [name, line] : *classes) {
      if (line.tags() < 50) continue;  // otherwise the mean itself has a standard deviation above 7 %
      EXPECT_GT(line.nees_tag(), low) << name;
      EXPECT_LT(line.nees_tag(), high) << name;
    }
  }
}

TEST(RefinementOnRenderedTags, HalvesTheErrorWithConsistentCovariance) {
  WAYMARK_REAL_DATA(folder, "synth-tags/clean");
  const Table table = measure(folder, 1, {});
  table.print("quad_decimate 1, edges may bend");
  expect_better_than_half(table);
  expect_consistent(table, 0.8, 1.15);
}

TEST(RefinementOnRenderedTags, IsAsAccurateFromACoarserStart) {
  WAYMARK_REAL_DATA(folder, "synth-tags/clean");
  const Table table = measure(folder, 2, {});
  table.print("quad_decimate 2, edges may bend");
  expect_better_than_half(table);
  expect_consistent(table, 0.8, 1.25);
}

TEST(RefinementOnRenderedTags, IsMoreAccurateIfEdgesAreStraight) {
  WAYMARK_REAL_DATA(folder, "synth-tags/clean");
  RefinementOptions straight;
  straight.curvature_per_px = 0;
  const Table table = measure(folder, 1, straight);
  table.print("quad_decimate 1, edges straight");
  expect_better_than_half(table);
  expect_consistent(table, 0.8, 1.25);
  const Table bent = measure(folder, 1, {});
  EXPECT_LT(table.by_size.at(115).rmse_px(), bent.by_size.at(115).rmse_px());
}

}  // namespace
}  // namespace waymark
