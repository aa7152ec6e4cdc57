// The parts of a map that depend on few observations: in albums of images without geometry, and in bundles
// whose covariance decides whether motion and priors check the observations.
#include "waymark/mapping/solver/thin_cuts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

/// Tags in images. Pose 0 is the map, 1 is the camera mounting, and 2 to 21 are tags; they are followed by
/// one pose for each image.
struct Album {
  Bundle bundle{};
  std::vector<char> moves{};

  Album() {
    for (int i = 0; i < 22; ++i) {
      bundle.add({}, i < 2);
      moves.push_back(0);
    }
  }
  void show(const std::vector<PoseIndex>& tags, int times = 1, bool used = true) {
    for (int i = 0; i < times; ++i) {
      const PoseIndex rig = bundle.add({});
      moves.push_back(1);
      for (PoseIndex tag : tags)
        bundle.corners.push_back({.rig = rig, .cam = 1, .body = 0, .tag = tag, .used = used});
    }
  }
  [[nodiscard]] std::vector<ThinCut> cuts(int most = 3) const {
    return thin_cuts(bundle, moves, {2}, ImageTies::Separate, most);
  }
  /// Connects all images so far by motion.
  void move() {
    for (PoseIndex rig = 23; rig < bundle.poses.size(); ++rig)
      bundle.relatives.push_back({.a = rig - 1, .b = rig});
  }
  [[nodiscard]] std::vector<ThinCut> cuts_beside_motion() const {
    return thin_cuts(bundle, moves, {2}, ImageTies::Moving);
  }
};

/// Two rooms with five tags each, which are observed often. The rooms are connected by `ties` images that
/// show the last tag of one room and the first tag of the other.
Album rooms(int ties) {
  Album album;
  album.show({2, 3, 4, 5, 6}, 10);
  album.show({7, 8, 9, 10, 11}, 10);
  album.show({6, 7}, ties);
  return album;
}

TEST(ThinCuts, ReportWeaklyConnectedTagsAndTheirConnection) {
  for (int ties = 1; ties <= 3; ++ties) {
    const auto cuts = rooms(ties).cuts();
    ASSERT_EQ(cuts.size(), 1U) << ties;
    EXPECT_EQ(cuts[0].beyond, (std::vector<PoseIndex>{7, 8, 9, 10, 11}));
    EXPECT_EQ(cuts[0].by, (std::vector<PoseIndex>{6}));
    EXPECT_EQ(cuts[0].observations, ties);
  }
}

TEST(ThinCuts, IgnorePartsWithMoreConnections) {
  EXPECT_TRUE(rooms(4).cuts().empty());
  EXPECT_EQ(rooms(4).cuts(4).size(), 1U);
}

TEST(ThinCuts, IgnoreObservationsNotInUse) {
  Album album = rooms(2);
  album.show({6, 7}, 10, false);
  ASSERT_EQ(album.cuts().size(), 1U);
  EXPECT_EQ(album.cuts()[0].observations, 2);
}

TEST(ThinCuts, MeasuredMotionConnectsImages) {
  Album album = rooms(1);
  album.move();
  EXPECT_EQ(album.cuts().size(), 1U);
  EXPECT_TRUE(album.cuts_beside_motion().empty());
}

TEST(ThinCuts, TheOnlyKnownTagIsInOneImageAmongMany) {
  Album album;
  album.show({3, 4, 5, 6}, 20);
  album.show({2, 3});
  album.show({3, 4, 5, 6}, 20);
  album.move();
  for (const std::vector<ThinCut>& cuts : {album.cuts(), album.cuts_beside_motion()}) {
    ASSERT_EQ(cuts.size(), 1U);
    EXPECT_EQ(cuts[0].beyond, (std::vector<PoseIndex>{3, 4, 5, 6}));
    EXPECT_EQ(cuts[0].observations, 1);
  }
  EXPECT_EQ(album.cuts_beside_motion()[0].by, (std::vector<PoseIndex>{2}));
}

TEST(ThinCuts, UnusedMotionConnectsNothing) {
  Album album = rooms(1);
  album.move();
  for (RelativeTerm& term : album.bundle.relatives) term.used = false;
  EXPECT_EQ(album.cuts_beside_motion().size(), 1U);
}

TEST(ThinCuts, IgnoreSingleTags) {
  Album album;
  album.show({2, 3, 4}, 10);
  album.show({4, 5}, 1);
  EXPECT_TRUE(album.cuts().empty());
}

TEST(ThinCuts, AreEmptyWithoutObservations) { EXPECT_TRUE(Album().cuts().empty()); }

TEST(RarelyObservedTags, AreThoseWithOneOrTwoObservationsInUse) {
  Album album;
  album.show({2});
  album.show({3, 4}, 2);
  album.show({4, 5});
  album.show({5, 6}, 4, false);
  const std::vector<ThinCut> rare = rarely_observed_tags(album.bundle, {2});
  ASSERT_EQ(rare.size(), 2U);
  EXPECT_EQ(rare[0].beyond, std::vector<PoseIndex>{3});
  EXPECT_EQ(rare[0].observations, 2);
  EXPECT_EQ(rare[1].beyond, std::vector<PoseIndex>{5});
}

/// Two walls with three tags each and a camera that moves from the first wall to the second one. `ties`
/// images show a tag of each. All poses are the ground truth.
struct TwoWalls {
  Bundle bundle{};
  std::vector<char> moves{};
  std::vector<PoseIndex> tags{};
  static constexpr PoseIndex kMap = 0, kCam = 1;

  explicit TwoWalls(int ties) {
    bundle.cameras = {
        CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value()};
    bundle.add({}, true);
    bundle.add({}, true);
    for (int i = 0; i < 6; ++i)
      tags.push_back(
          bundle.add(SE3(SO3::exp({0.3, 0.2 * i, 0}), Eigen::Vector3d(0.4 * i, 0.1 * (i % 2), 2)), i == 0));
    for (int k = 0; k < 6; ++k) film(0.2 + 0.05 * k, {0, 1, 2});
    for (int k = 0; k < ties; ++k) film(1 + 0.05 * k, {2, 3});
    for (int k = 0; k < 6; ++k) film(1.6 + 0.05 * k, {3, 4, 5});
    moves.assign(bundle.poses.size(), 1);
    for (PoseIndex i = 0; i <= tags.back(); ++i) moves[i] = 0;
  }
  void film(double x_m, const std::vector<std::size_t>& shown) {
    const PoseIndex rig = bundle.add(SE3(SO3(), Eigen::Vector3d(x_m, 0, 0)));
    for (const std::size_t i : shown) {
      const auto corners = visible_corners(
          bundle.cameras[0], bundle.poses[rig].value.inverse() * bundle.poses[tags[i]].value, 0.2);
      ASSERT_TRUE(corners);
      TagDetection seen;
      seen.corners_px = *corners;
      bundle.corners.push_back({rig, kCam, kMap, tags[i], 0, corner_factor(seen, 0.2, 0.3).value()});
    }
  }
  /// Measured motion between successive images.
  void move(double sigma_m) {
    for (PoseIndex rig = tags.back() + 2; rig < bundle.poses.size(); ++rig)
      bundle.relatives.push_back(
          {.a = rig - 1,
           .b = rig,
           .factor = {.measured = bundle.poses[rig - 1].value.inverse() * bundle.poses[rig].value,
                      .whitening = Matrix6::Identity() / sigma_m}});
  }
  std::vector<ThinCut> cuts() { return unchecked_cuts(bundle, covariance(bundle), moves, {tags[0]}); }
};

TEST(UncheckedCuts, AreThoseThatNothingElseConnects) {
  for (int ties = 1; ties <= 4; ++ties) {
    TwoWalls walls(ties);
    const std::vector<ThinCut> cuts = walls.cuts();
    ASSERT_EQ(cuts.size(), ties <= 3 ? 1U : 0U) << ties;
    if (ties > 3) continue;
    EXPECT_EQ(cuts[0].beyond, (std::vector<PoseIndex>{walls.tags[3], walls.tags[4], walls.tags[5]}));
    EXPECT_EQ(cuts[0].observations, ties);
    EXPECT_FALSE(cuts[0].otherwise_sigma_m);
  }
}

TEST(UncheckedCuts, PreciseMotionChecksObservationsAndUncertainMotionDoesNot) {
  TwoWalls precise(1);
  precise.move(1e-4);
  EXPECT_THAT(precise.cuts(), SizeIs(0));
  TwoWalls uncertain(1);
  uncertain.move(0.05);
  const std::vector<ThinCut> cuts = uncertain.cuts();
  ASSERT_THAT(cuts, SizeIs(1));
  ASSERT_TRUE(cuts[0].otherwise_sigma_m);
  EXPECT_GT(*cuts[0].otherwise_sigma_m, 0.05);
  EXPECT_LT(*cuts[0].otherwise_sigma_m, 0.5);
}

TEST(UncheckedCuts, PrecisePriorsCheckObservationsAndWeakOnesDoNot) {
  for (const double sigma_m : {1e-4, 0.5}) {
    TwoWalls walls(1);
    for (const PoseIndex tag : {walls.tags[3], walls.tags[4], walls.tags[5]})
      walls.bundle.priors.push_back(
          {tag, {.prior = walls.bundle.poses[tag].value, .whitening = Matrix6::Identity() / sigma_m}});
    EXPECT_THAT(walls.cuts(), SizeIs(sigma_m > 0.1 ? 1 : 0)) << sigma_m;
  }
}

TEST(UncheckedCuts, LeaveTheBundleAsItIs) {
  TwoWalls walls(1);
  walls.move(0.05);
  walls.bundle.corners[0].used = false;
  const double before = cost(walls.bundle);
  (void)walls.cuts();
  EXPECT_EQ(cost(walls.bundle), before);
  EXPECT_FALSE(walls.bundle.corners[0].used);
  EXPECT_EQ(std::ranges::count_if(walls.bundle.corners, &CornerTerm::used),
            std::ssize(walls.bundle.corners) - 1);
}

TEST(DescribeCuts, ReportsAtMostFivePartsAndAllRarelyObservedTagsTogether) {
  const auto tag = [](int number) { return TagId{FamilyId::Tag36h11, number}; };
  const auto names = [](const std::vector<TagId>& tags) { return std::to_string(tags.size()) + " tags"; };
  std::vector<TagCut> cuts(7, TagCut{{tag(1), tag(2)}, {tag(3)}, 2, 0.25});
  EXPECT_THAT(describe(cuts, names), SizeIs(5));
  EXPECT_THAT(describe(cuts, names)[0], HasSubstr("0.25 m"));
  cuts = {{{tag(1)}, {tag(1)}, 1, {}}, {{tag(4)}, {tag(4)}, 2, {}}};
  ASSERT_THAT(describe(cuts, names), SizeIs(1));
  EXPECT_THAT(describe(cuts, names)[0], HasSubstr("2 tags"));
}

}  // namespace
}  // namespace waymark
