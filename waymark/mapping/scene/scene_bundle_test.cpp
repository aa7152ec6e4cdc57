// Tests the selection of detections, and which poses are fixed if there are no priors.
#include "waymark/mapping/scene/scene_bundle.hpp"

#include <algorithm>
#include <utility>

#include <gtest/gtest.h>

namespace waymark {
namespace {

SensorTime at_ms(std::int64_t ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// One camera, a wall that accepts unlisted ids, and a box with one tag.
TagScene scene() {
  TagScene scene;
  scene.bodies.push_back({.name = "wall", .default_tag_size_m = 0.2});
  scene.bodies.push_back({.name = "box", .tags = {{{FamilyId::Tag36h11, 7}, 0.1, {}}}});
  scene.default_body = 0;
  scene.cameras.push_back(
      {.name = "cam0",
       .model =
           CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value()});
  return scene;
}

TagDetection square(int number, double side_px, int hamming = 0) {
  TagDetection detection{.tag = {FamilyId::Tag36h11, number}, .hamming = hamming};
  detection.corners_px = {Eigen::Vector2d(100, 100), Eigen::Vector2d(100 + side_px, 100),
                          Eigen::Vector2d(100 + side_px, 100 + side_px), Eigen::Vector2d(100, 100 + side_px)};
  return detection;
}

SceneRecording one_view(const std::vector<TagDetection>& detections) {
  return {.frames = {{at_ms(1000), {{.camera = 0, .detections = detections}}}}};
}

TEST(SceneObservations, IdsBelongToTheirBodyOrTheDefaultBody) {
  TagScene s = scene();
  const SceneObservations seen = observations_of(one_view({square(7, 50), square(30, 50)}), s);
  ASSERT_EQ(seen.seen.size(), 2U);
  EXPECT_EQ(seen.seen[0].body, 1U);
  EXPECT_DOUBLE_EQ(seen.seen[0].factor.size_m, 0.1);
  EXPECT_EQ(seen.seen[1].body, 0U);
  EXPECT_DOUBLE_EQ(seen.seen[1].factor.size_m, 0.2);
  EXPECT_EQ(s.bodies[0].tags.size(), 1U) << "the unlisted tag was added";
}

TEST(SceneObservations, WithoutADefaultBodyAnUnlistedIdIsForeign) {
  TagScene s = scene();
  s.default_body.reset();
  const SceneObservations seen = observations_of(one_view({square(30, 50), square(7, 50)}), s);
  EXPECT_EQ(seen.seen.size(), 1U);
  EXPECT_EQ(seen.foreign.at({FamilyId::Tag36h11, 30}), 1);
}

TEST(SceneObservations, SmallTagsCorrectedBitsAndIgnoredIdsAreSkipped) {
  TagScene s = scene();
  s.min_tag_area_px2 = 100;
  s.max_hamming = 1;
  s.bodies[0].ignored = {31};
  s.bodies[1].max_hamming = 0;
  const SceneObservations seen = observations_of(
      one_view({square(30, 9), square(32, 50, 2), square(31, 50), square(7, 50, 1), square(33, 11, 1)}), s);
  ASSERT_EQ(seen.seen.size(), 1U);
  EXPECT_EQ(s.bodies[0].tags[seen.seen[0].tag].id.number, 33);
  EXPECT_EQ(seen.squashed, 4);
}

TEST(SceneObservations, ADuplicateIdInAViewCountsOnce) {
  TagScene s = scene();
  const SceneObservations seen = observations_of(one_view({square(7, 50), square(7, 40)}), s);
  EXPECT_EQ(seen.seen.size(), 1U);
  EXPECT_EQ(seen.repeated, 1);
}

TEST(SceneObservations, TwoTagsWithOneIdInAFewViewsAreKeptOnRequest) {
  for (const std::size_t views : {3U, 4U}) {
    TagScene s = scene();
    SceneRecording recording;
    TagDetection other = square(7, 50);
    for (Eigen::Vector2d& corner : other.corners_px) corner.x() += 200;
    TagDetection same = square(7, 48);  // the first one, detected twice
    for (std::size_t i = 0; i < views; ++i)
      recording.frames.push_back(
          {at_ms(100 * static_cast<std::int64_t>(i)), {{0, {square(7, 50), same, square(30, 50), other}}}});
    const SceneObservations seen = observations_of(recording, s, RepeatedIds::All);
    EXPECT_EQ(seen.seen.size(), (views < 4 ? 2 : 3) * views);
    EXPECT_EQ(seen.repeated, static_cast<int>((views < 4 ? 2 : 1) * views));
    EXPECT_EQ(observations_of(recording, s).seen.size(), 2 * views);
    EXPECT_TRUE(std::ranges::is_sorted(seen.seen, {}, &SceneObservation::frame));
  }
}

/// Moves the corners of an observation, and compresses the image of the tag horizontally.
TagDetection oblique(TagDetection detection, double width, double right_px) {
  for (Eigen::Vector2d& corner : detection.corners_px)
    corner.x() = 100 + width * (corner.x() - 100) + right_px;
  return detection;
}

TEST(SceneObservations, NearTagsWithOneIdAreKeptOnRequestIfTheyDoNotOverlap) {
  // The distance is that of two prints whose centres are 1.08 sides apart; 0.4 sides are those of one tag.
  for (const double width : {1.0, 0.5, 0.15}) {
    for (const auto& [sides, kept] : {std::pair(1.08, 8U), {-1.08, 8U}, {0.4, 4U}}) {
      TagScene s = scene();
      SceneRecording recording;
      for (int i = 0; i < 4; ++i)
        recording.frames.push_back(
            {at_ms(100 * i),
             {{0, {oblique(square(7, 50), width, 0), oblique(square(7, 50), width, 50 * width * sides)}}}});
      EXPECT_EQ(observations_of(recording, s, RepeatedIds::All).seen.size(), kept) << width << ' ' << sides;
    }
  }
}

TEST(SceneObservations, UnreliableCornersAreSkippedAndCounted) {
  TagScene s = scene();
  TagDetection unreliable = square(7, 50);
  unreliable.corner_state = CornerState::Unreliable;
  const SceneObservations seen = observations_of(one_view({unreliable, square(30, 50)}), s);
  ASSERT_EQ(seen.seen.size(), 1U);
  EXPECT_EQ(seen.seen[0].body, 0U);
  EXPECT_EQ(seen.unreliable, 1);
}

TEST(SceneObservations, ARemapAppliesDuringItsTime) {
  TagScene s = scene();
  s.remaps = {{.id = 7, .becomes = 70, .from = at_ms(900), .to = at_ms(1000)}};
  EXPECT_EQ(observations_of(one_view({square(7, 50)}), s).seen.at(0).body, 0U);
  s.remaps[0].to = at_ms(999);
  EXPECT_EQ(observations_of(one_view({square(7, 50)}), s).seen.at(0).body, 1U);
  s.remaps[0] = {.id = 7, .becomes = 70, .from = at_ms(0), .to = at_ms(5000), .camera = "other"};
  EXPECT_EQ(observations_of(one_view({square(7, 50)}), s).seen.at(0).body, 1U);
}

TEST(SceneBundle, FailsWithoutAStaticBody) {
  TagScene s = scene();
  for (SceneBody& body : s.bodies) body.is_static = false;
  const SceneRecording recording = one_view({square(7, 50)});
  const SceneObservations seen = observations_of(recording, s);
  EXPECT_FALSE(scene_bundle(s, recording, seen));
}

TEST(SceneBundle, FixesOneTagWithoutPriors) {
  TagScene s = scene();
  s.bodies.push_back({.name = "rig", .is_static = false});
  s.cameras[0].body = 2;
  const SceneRecording recording = one_view({square(30, 50), square(31, 60)});
  const SceneObservations seen = observations_of(recording, s);
  const auto problem = scene_bundle(s, recording, seen);
  ASSERT_TRUE(problem) << to_string(problem.error());
  int held = 0;
  for (PoseIndex tag : problem->tags[0]) held += problem->bundle.poses[tag].fixed ? 1 : 0;
  EXPECT_EQ(held, 1);
  EXPECT_TRUE(problem->bundle.poses[problem->bodies[0].front()].fixed);
  EXPECT_EQ(problem->bundle.corners.size(), seen.seen.size());
}

}  // namespace
}  // namespace waymark
