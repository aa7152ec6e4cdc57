// Where a row of tags hangs together by little.
#include "waymark/mapping/scene/thin_cuts.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// Tags in pictures: pose 0 is the map, 1 the camera's place, 2 to 21 are tags, then one pose a picture.
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
  [[nodiscard]] std::vector<ThinCut> cuts(int most = 3) const { return thin_cuts(bundle, moves, {2}, most); }
};

/// Two rooms of five tags seen often, tied by so many pictures of the last tag of the one and the first of
/// the other.
Album rooms(int ties) {
  Album album;
  album.show({2, 3, 4, 5, 6}, 10);
  album.show({7, 8, 9, 10, 11}, 10);
  album.show({6, 7}, ties);
  return album;
}

TEST(ThinCuts, NamesWhatHangsOnFewObservationsAndOnWhich) {
  for (int ties = 1; ties <= 3; ++ties) {
    const auto cuts = rooms(ties).cuts();
    ASSERT_EQ(cuts.size(), 1U) << ties;
    EXPECT_EQ(cuts[0].beyond, (std::vector<PoseIndex>{7, 8, 9, 10, 11}));
    EXPECT_EQ(cuts[0].by, (std::vector<PoseIndex>{6}));
    EXPECT_EQ(cuts[0].observations, ties);
  }
}

TEST(ThinCuts, WhatHangsOnMoreIsNotThin) {
  EXPECT_TRUE(rooms(4).cuts().empty());
  EXPECT_EQ(rooms(4).cuts(4).size(), 1U);
}

TEST(ThinCuts, ObservationsThatAreNotUsedTieNothing) {
  Album album = rooms(2);
  album.show({6, 7}, 10, false);
  ASSERT_EQ(album.cuts().size(), 1U);
  EXPECT_EQ(album.cuts()[0].observations, 2);
}

TEST(ThinCuts, AMeasuredMotionTiesPictures) {
  Album album = rooms(1);
  const PoseIndex first = 22;
  for (PoseIndex rig = first + 1; rig < album.bundle.poses.size(); ++rig)
    album.bundle.relatives.push_back({.a = rig - 1, .b = rig});
  EXPECT_TRUE(album.cuts().empty());
}

TEST(ThinCuts, ASingleTagIsNoPart) {
  Album album;
  album.show({2, 3, 4}, 10);
  album.show({4, 5}, 1);
  EXPECT_TRUE(album.cuts().empty());
}

TEST(ThinCuts, NothingSeenHasNoCuts) { EXPECT_TRUE(Album().cuts().empty()); }

}  // namespace
}  // namespace waymark
