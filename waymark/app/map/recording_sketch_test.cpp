#include "waymark/app/map/recording_sketch.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Frames with one tag that moves through the image; other seeds give other laps.
std::vector<TagFrame> moving_tags(std::uint64_t seed, std::size_t frames = 400) {
  Random random(seed);
  std::vector<TagFrame> made;
  for (std::size_t i = 0; i < frames; ++i) {
    TagDetection seen{.tag = {FamilyId::Tag36h11, static_cast<int>(i / 40)}};
    const Eigen::Vector2d at(10 + 14.0 * static_cast<double>(i % 40), 200 + 5 * random.normal());
    const double side_px = 40 + 3 * random.normal();
    seen.corners_px = {at, Eigen::Vector2d(at.x() + side_px, at.y()),
                       Eigen::Vector2d(at.x() + side_px, at.y() + side_px),
                       Eigen::Vector2d(at.x(), at.y() + side_px)};
    made.push_back({.detections = {seen}});
  }
  return made;
}

std::vector<TagFrame> part_of(const std::vector<TagFrame>& frames, std::size_t begin, std::size_t end) {
  return {frames.begin() + static_cast<std::ptrdiff_t>(begin),
          frames.begin() + static_cast<std::ptrdiff_t>(end)};
}

TEST(RecordingSketch, EstimatesTheCommonShare) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<TagFrame> frames = moving_tags(seed);
    const RecordingSketch all = sketch_of("a", frames);
    EXPECT_EQ(all.hashes.size(), 32U);
    EXPECT_EQ(common_share(all, all), 1);
    EXPECT_EQ(common_share(all, sketch_of("b", part_of(frames, 100, 200))), 1)
        << "a trimmed recording, " << seed;
    EXPECT_LT(common_share(all, sketch_of("b", moving_tags(seed + 100))), 0.1) << seed;
    std::vector<TagFrame> half = part_of(frames, 200, 400);
    const std::vector<TagFrame> other = part_of(moving_tags(seed + 100), 0, 200);
    half.insert(half.end(), other.begin(), other.end());
    EXPECT_NEAR(common_share(all, sketch_of("b", half)), 0.5, 0.3) << seed;
  }
  EXPECT_EQ(common_share({}, sketch_of("a", moving_tags(1))), 0);
}

TEST(RecordingSketch, IgnoresInvalidCornersAndRoundingOfTables) {
  std::vector<TagFrame> frames = moving_tags(1);
  const RecordingSketch exact = sketch_of("a", frames);
  for (TagFrame& frame : frames) {
    for (Eigen::Vector2d& corner : frame.detections[0].corners_px)
      corner = (1000 * corner).array().round().matrix() / 1000;
  }
  EXPECT_GT(common_share(exact, sketch_of("b", frames)), 0.9) << "three decimals";
  frames.push_back({.detections = {{.corners_px = {Eigen::Vector2d::Constant(1e300)}}}});
  frames.push_back({.detections = {{.corners_px = {Eigen::Vector2d::Constant(std::nan(""))}}}});
  EXPECT_GT(common_share(exact, sketch_of("b", frames)), 0.9);
}

TEST(RecordingSketch, IsStoredInTheProvenance) {
  const RecordingSketch first = sketch_of("lap 1, evening: 2.mcap", moving_tags(1));
  const RecordingSketch second = sketch_of("b.mcap", moving_tags(2, 10));
  MapProvenance provenance = {{"method", "bundle"}, {"recording", "x"}, {"extends", "y"}};
  add_sketches({first, {.name = "poses only"}, second}, provenance);
  ASSERT_EQ(provenance.size(), 5U);
  EXPECT_EQ(provenance[2].first, "content");
  EXPECT_EQ(provenance[3].first, "content_2");
  EXPECT_EQ(provenance[4].first, "extends");
  const std::vector<RecordingSketch> back = sketches_of(provenance);
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].name, first.name);
  EXPECT_EQ(back[0].hashes, first.hashes);
  EXPECT_EQ(back[1].name, second.name);
  EXPECT_EQ(back[1].hashes, second.hashes);
  EXPECT_THAT(sketches_of({{"content", "edited by hand"}, {"content_2", ""}}), IsEmpty());
}

TEST(RepeatedRecording, IsRecognisedByItsContentUnderAnyName) {
  MapProvenance map = {{"method", "bundle"}, {"recording", "lap1.mcap"}};
  add_sketches({sketch_of("lap1.mcap", moving_tags(1))}, map);
  EXPECT_THAT(repeated_recording(map, sketch_of("renamed.mcap", moving_tags(1))), HasSubstr("lap1.mcap"));
  EXPECT_THAT(repeated_recording(map, sketch_of("trimmed.mcap", part_of(moving_tags(1), 0, 150))),
              HasSubstr("lap1.mcap"));
  EXPECT_THAT(repeated_recording(map, sketch_of("lap2.mcap", moving_tags(2))), IsEmpty());
  EXPECT_THAT(repeated_recording(map, sketch_of("lap1.mcap", moving_tags(2))), IsEmpty())
      << "another lap, same name";
}

TEST(RepeatedRecording, MapsWithoutContentAreComparedByName) {
  const MapProvenance map = {{"recording", "lap2.mcap"}, {"extends", "lap0.mcap, lap1.mcap"}};
  for (const char* name : {"lap0.mcap", "lap1.mcap", "lap2.mcap"})
    EXPECT_THAT(repeated_recording(map, sketch_of(name, moving_tags(3))), HasSubstr(name));
  EXPECT_THAT(repeated_recording(map, sketch_of("lap3.mcap", moving_tags(3))), IsEmpty());
  EXPECT_THAT(repeated_recording(map, {.name = "lap1.mcap"}), HasSubstr("lap1.mcap")) << "tag poses only";
  MapProvenance mixed = {{"recording", "lap1.mcap"}, {"extends", "lap1.mcap"}};
  add_sketches({sketch_of("lap1.mcap", moving_tags(1))}, mixed);
  EXPECT_THAT(repeated_recording(mixed, sketch_of("lap1.mcap", moving_tags(2))), HasSubstr("lap1.mcap"))
      << "one of the two has no content";
}

}  // namespace
}  // namespace waymark
