// Observations that confirm each other, in views with known poses.
#include "waymark/mapping/solver/pose_votes.hpp"

#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark::internal {
namespace {

/// A camera that moves along a row of tags with a spacing of 1 m.
struct Row {
  std::vector<ViewedTag> seen{};
  std::vector<std::vector<Hypothesis>> poses{};
  std::vector<ViewMotion> motions{};

  /// Adds an observation of the tag at position number `at`, with the id `tag`.
  void see(std::size_t view, std::size_t tag, std::size_t at) {
    const SE3 cam_T_tag(SO3(), {static_cast<double>(at) - place(view), 0, 3});
    seen.push_back({view, tag});
    poses.push_back({{cam_T_tag, 1e-4 * Matrix6::Identity(), 0}});
  }
  void see(std::size_t view, std::size_t tag) { see(view, tag, tag); }
  /// Sets the image positions for a camera with a focal length of 400 px.
  void set_image_positions() {
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Eigen::Vector3d p = poses[i].front().value.translation();
      seen[i].centre_px = 400 * p.head<2>() / p.z();
      seen[i].size_px = 100;
    }
  }
  [[nodiscard]] static double place(std::size_t view) { return 0.05 * static_cast<double>(view); }
  [[nodiscard]] Confirmation confirmed() const { return confirm_observations(seen, poses, motions); }
};

int count(const Confirmation& confirmation) {
  return std::accumulate(confirmation.unconfirmed.begin(), confirmation.unconfirmed.end(), 0);
}

/// Each view shows three consecutive tags.
Row walk(std::size_t views) {
  Row row;
  for (std::size_t view = 0; view < views; ++view) {
    for (std::size_t tag = view / 20; tag < view / 20 + 3; ++tag) row.see(view, tag);
  }
  return row;
}

TEST(ConfirmedObservations, ConsistentTagsAreConfirmed) {
  const Confirmation confirmation = walk(200).confirmed();
  EXPECT_EQ(count(confirmation), 0);
  EXPECT_EQ(confirmation.min_votes, 2);
}

TEST(ConfirmedObservations, OnlyAMisreadIdIsUnconfirmed) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Row row = walk(200);
    const std::size_t which = random.index(row.seen.size());
    row.seen[which].tag = row.seen[which].tag + 4 + random.index(8);  // an id that does not occur in its view
    const Confirmation confirmation = row.confirmed();
    EXPECT_EQ(confirmation.unconfirmed[which], 1) << "seed " << seed;
    EXPECT_EQ(count(confirmation), 1) << "seed " << seed;
  }
}

/// The groups of the observations of this tag at this position.
std::set<std::size_t> groups_at(const Row& row, const Confirmation& confirmation, std::size_t tag,
                                std::size_t at) {
  std::set<std::size_t> groups;
  for (std::size_t i = 0; i < row.seen.size(); ++i) {
    const double x = row.poses[i].front().value.translation().x() + Row::place(row.seen[i].view);
    if (row.seen[i].tag == tag && std::abs(x - static_cast<double>(at)) < 0.1)
      groups.insert(confirmation.groups[i]);
  }
  return groups;
}

TEST(ConfirmedObservations, DuplicateTagsInEachViewFormTwoGroups) {
  Row row;
  for (std::size_t view = 0; view < 60; ++view) {
    row.see(view, 1);
    for (const std::size_t tag : {2U, 3U, 4U}) {
      row.see(view, tag);
      row.see(view, tag, 3 * tag);  // not as far from each other as the first ones
    }
  }
  const Confirmation confirmation = row.confirmed();
  EXPECT_EQ(count(confirmation), 0);
  for (const std::size_t tag : {2U, 3U, 4U}) {
    const std::set<std::size_t> first = groups_at(row, confirmation, tag, tag);
    const std::set<std::size_t> second = groups_at(row, confirmation, tag, 3 * tag);
    EXPECT_EQ(first.size(), 1U);
    EXPECT_EQ(second.size(), 1U);
    EXPECT_NE(first, second) << tag;
  }
}

TEST(ConfirmedObservations, ADuplicateTagConfirmsItsNeighboursInAnyOrderOfDetection) {
  Row row;
  for (std::size_t view = 0; view < 40; ++view) {
    row.see(view, 5);
    row.see(view, 2, view % 2 == 0 ? 2 : 4);
    row.see(view, 2, view % 2 == 0 ? 4 : 2);
  }
  EXPECT_EQ(groups_at(row, row.confirmed(), 5, 5).size(), 1U);
}

TEST(ConfirmedObservations, TheOrderOfTagsInAViewDoesNotMatter) {
  Row row = walk(60);
  row.seen[31].tag = 9;
  row.seen[90].tag = 7;
  const Confirmation forwards = row.confirmed();
  Row mirrored;
  std::vector<std::size_t> from;
  for (std::size_t view = 0; view < 60; ++view) {
    for (std::size_t k = 3; k-- > 0;) {
      from.push_back(3 * view + k);
      mirrored.seen.push_back(row.seen[from.back()]);
      mirrored.poses.push_back(row.poses[from.back()]);
    }
  }
  const Confirmation backwards = mirrored.confirmed();
  for (std::size_t i = 0; i < from.size(); ++i)
    EXPECT_EQ(backwards.unconfirmed[i], forwards.unconfirmed[from[i]]) << i;
}

TEST(ConfirmedObservations, MoreWrongIdsRequireMoreVotes) {
  Random random(4);
  Row row = walk(200);
  for (std::size_t i = 0; i < row.seen.size(); i += 9) row.seen[i].tag = random.index(12);
  EXPECT_GT(row.confirmed().min_votes, 2);
}

TEST(ConfirmedObservations, AKnownMotionConfirmsATagWithoutNeighbours) {
  Row row;
  for (std::size_t view = 0; view < 12; ++view) {
    row.see(view, 0);
    if (view % 2 == 1) row.see(view, 20 + view);  // an id that occurs only once
    row.motions.push_back({view > 0, SE3(SO3(), {0.05, 0, 0}), 1e-6 * Matrix6::Identity()});
  }
  const Confirmation confirmation = row.confirmed();
  for (std::size_t i = 0; i < row.seen.size(); ++i)
    EXPECT_EQ(confirmation.unconfirmed[i], row.seen[i].tag == 0 ? 0 : 1) << i;
}

/// Tag 1 appears next to tag 0 in two views, then alone, then next to tag 2. In addition, there are some
/// wrong ids.
Row passed_on() {
  Row row = walk(0);
  for (std::size_t view = 0; view < 20; ++view) {
    if (view < 2) row.see(view, 0);
    row.see(view, 1);
    if (view >= 10) row.see(view, 2);
  }
  for (std::size_t view = 30; view < 40; ++view) {  // pairs of ids that do not occur in any other view
    row.see(view, 2 * view);
    row.see(view, 2 * view + 1);
  }
  return row;
}

TEST(ConfirmedObservations, ATagThatHardlyMovesInTheImageIsConfirmed) {
  Row row = passed_on();
  const Confirmation without = row.confirmed();
  EXPECT_EQ(without.unconfirmed[1], 1) << "next to tag 0, there are only two votes, and many ids are wrong";
  row.set_image_positions();
  const Confirmation with = row.confirmed();
  for (std::size_t i = 0; i < row.seen.size(); ++i)
    EXPECT_EQ(with.unconfirmed[i], row.seen[i].view >= 30 ? 1 : 0) << i;
}

TEST(ConfirmedObservations, ATagThatJumpsInTheImageIsUnconfirmed) {
  Row row = passed_on();
  row.set_image_positions();
  for (std::size_t i = 0; i < row.seen.size(); ++i) {
    if (row.seen[i].tag == 1 && row.seen[i].view >= 2) row.seen[i].centre_px.x() += 60;
  }
  EXPECT_EQ(row.confirmed().unconfirmed[1], 1);
}

TEST(ConfirmedObservations, TwoTagsWithOneIdAreTwoGroups) {
  Row row = walk(200);
  for (ViewedTag& seen : row.seen) seen.tag = seen.tag == 9 ? 1 : seen.tag;
  const Confirmation confirmation = row.confirmed();
  EXPECT_EQ(count(confirmation), 0);
  for (std::size_t i = 0; i < row.seen.size(); ++i) {
    const std::size_t first = confirmation.groups[i];
    EXPECT_EQ(row.seen[first].tag, row.seen[i].tag);
    EXPECT_EQ(confirmation.groups[first], first);
    if (row.seen[i].tag == 1) EXPECT_EQ(row.seen[first].view, row.seen[i].view < 60 ? 0U : 140U) << i;
  }
}

TEST(ConfirmedObservations, NearTagsWithOneIdInEachViewAreTwoGroups) {
  // Their poses are so uncertain that each of them could be at the place of the other one.
  for (const bool in_image : {false, true}) {
    Random random(5);
    Row row;
    std::vector<std::size_t> print;
    for (std::size_t view = 0; view < 40; ++view) {
      row.see(view, 5);
      row.see(view, 6);
      row.see(view, 2);
      row.see(view, 2);
      const std::size_t first = row.seen.size() - 2 + view % 2;  // in any order
      row.poses[first].front().value = SE3(SO3(), {0.27, 0, 0}) * row.poses[first].front().value;
      for (std::size_t i = row.seen.size() - 4; i < row.seen.size(); ++i) {
        SE3& cam_T_tag = row.poses[i].front().value;
        cam_T_tag = SE3(SO3(), {0.02 * random.normal(), 0.02 * random.normal(), 0}) * cam_T_tag;
        row.poses[i].front().covariance = 4e-3 * Matrix6::Identity();
        print.push_back(i == first ? 1 : 0);
      }
    }
    if (in_image) row.set_image_positions();
    const Confirmation confirmation = row.confirmed();
    EXPECT_EQ(count(confirmation), 0);
    std::array<std::set<std::size_t>, 2> groups;
    for (std::size_t i = 0; i < row.seen.size(); ++i) {
      if (row.seen[i].tag == 2) groups.at(print[i]).insert(confirmation.groups[i]);
    }
    EXPECT_EQ(groups[0].size(), 1U) << in_image;
    EXPECT_EQ(groups[1].size(), 1U) << in_image;
    EXPECT_NE(groups[0], groups[1]) << in_image;
  }
}

TEST(ConfirmedObservations, ATagAloneInItsViewIsNeverUnconfirmed) {
  Row row;
  for (std::size_t view = 0; view < 5; ++view) row.see(view, view);
  EXPECT_EQ(count(row.confirmed()), 0);
  EXPECT_TRUE(Row().confirmed().unconfirmed.empty());
}

}  // namespace
}  // namespace waymark::internal
