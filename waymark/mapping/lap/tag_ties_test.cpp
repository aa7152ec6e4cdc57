#include "waymark/mapping/lap/tag_ties.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

Matrix6 step() {
  Matrix6 Q = 1e-4 * Matrix6::Identity();
  Q(0, 5) = Q(5, 0) = 5e-5;
  return Q;
}

/// The error of each tag is that of the previous tag plus an independent error, so P_jk = (min(j, k) + 1) Q.
TagMap chain_of_five() {
  TagMap map;
  internal::TagPairs pairs;
  std::vector<Matrix6> covariances;
  for (int j = 0; j < 5; ++j) {
    map.tags[tag(j)] = {.map_T_tag = SE3({}, {1.0 * j, 0, 0}), .size_m = 0.1, .covariance = (j + 1) * step()};
    for (int k = 0; k < j; ++k) {
      pairs.emplace_back(tag(k), tag(j));
      covariances.emplace_back((k + 1) * step());
    }
  }
  internal::tie_tags(pairs, covariances, map);
  return map;
}

TEST(TagTies, FollowTheChainOfGrowingErrors) {
  const TagMap map = chain_of_five();
  int roots = 0;
  for (const auto& [id, mapped] : map.tags) {
    if (!mapped.tie) {
      ++roots;
      continue;
    }
    EXPECT_EQ(std::abs(mapped.tie->to.number - id.number), 1);
    const internal::TiedError error = internal::tied_error(mapped, *map.find(mapped.tie->to));
    EXPECT_LT((error.gain - Matrix6::Identity()).norm(), 1e-6);
    EXPECT_LT((error.covariance - step()).norm(), 1e-9);
  }
  EXPECT_EQ(roots, 1);
}

TEST(TagTies, RemovingATagKeepsTheOtherTies) {
  TagMap map = chain_of_five();
  remove_tag(map, tag(2));
  ASSERT_EQ(map.find(tag(2)), nullptr);
  const MappedTag& after = *map.find(tag(3));
  ASSERT_TRUE(after.tie);
  EXPECT_EQ(after.tie->to, tag(1));
  EXPECT_LT((after.tie->covariance - 2 * step()).norm(), 1e-9) << "the common error of 1 and 3 is that of 1";
  remove_tag(map, tag(0));  // the root of the tree
  EXPECT_FALSE(map.find(tag(1))->tie);
  EXPECT_EQ(map.find(tag(3))->tie->to, tag(1));
  remove_tag(map, tag(9));  // a tag that is not in the map
  EXPECT_EQ(map.tags.size(), 3U);
}

TEST(TagTies, ChildrenOfARemovedRootAreTiedToEachOther) {
  TagMap map;
  for (int j = 0; j < 3; ++j) map.tags[tag(j)] = {.size_m = 0.1, .covariance = (j == 0 ? 1 : 2) * step()};
  for (int j : {1, 2}) map.tags[tag(j)].tie = TagTie{tag(0), step()};
  remove_tag(map, tag(0));
  EXPECT_FALSE(map.find(tag(1))->tie);
  ASSERT_TRUE(map.find(tag(2))->tie);
  EXPECT_EQ(map.find(tag(2))->tie->to, tag(1));
  EXPECT_LT((map.find(tag(2))->tie->covariance - step()).norm(), 1e-9);
}

}  // namespace
}  // namespace waymark
