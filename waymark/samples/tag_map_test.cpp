#include "waymark/samples/tag_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(FamiliesOf, ListsEachFamilyOnce) {
  TagMap map;
  EXPECT_THAT(families_of(map), IsEmpty());
  for (const TagId& id :
       {TagId{FamilyId::Tag36h11, 1}, TagId{FamilyId::Tag16h5, 2}, TagId{FamilyId::Tag36h11, 3}})
    map.tags[id] = {};
  EXPECT_THAT(families_of(map), ElementsAre("tag16h5", "tag36h11"));
}

}  // namespace
}  // namespace waymark
