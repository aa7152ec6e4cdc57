#include "waymark/config/share.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

TEST(Share, NamesAndPathsAreFound) {
  const auto folder = testing::fresh_folder("share");
  std::filesystem::create_directories(folder / "worlds");
  std::ofstream(folder / "worlds/garden.yaml") << "name: garden\n";
  ASSERT_EQ(setenv("WAYMARK_SHARE", folder.c_str(), 1), 0);
  EXPECT_EQ(*find_shared("worlds", "garden"), folder / "worlds/garden.yaml");
  EXPECT_EQ(*find_shared("worlds", "./garden"), "./garden");
  EXPECT_EQ(*find_shared("worlds", "my.yaml"), "my.yaml");
  EXPECT_EQ(to_string(find_shared("worlds", "gardn").error()),
            "(world): there is no 'gardn' in " + (folder / "worlds").string() +
                ". Did you mean 'garden'? Or give the path of a .yaml file.");
  EXPECT_EQ(find_shared("worlds", "gardn", "place").error().place.key, "place");
  std::filesystem::create_directories(folder / "place");
  std::ofstream(folder / "place/world.yaml") << "name: place\n";
  EXPECT_NE(to_string(find_shared("worlds", (folder / "place").string()).error())
                .find("Did you mean " + (folder / "place/world.yaml").string() + "?"),
            std::string::npos);
  EXPECT_EQ(to_string(find_shared("worlds", (folder / "worlds").string()).error()),
            "(world): '" + (folder / "worlds").string() + "' is a folder. Give the path of a .yaml file.");
  EXPECT_FALSE(find_shared("robots", "limo"));
  ASSERT_EQ(setenv("WAYMARK_SHARE", "/nowhere", 1), 0);
  EXPECT_NE(to_string(share_folder().error()).find("/nowhere: WAYMARK_SHARE names a folder"),
            std::string::npos);
  ASSERT_EQ(unsetenv("WAYMARK_SHARE"), 0);
  EXPECT_TRUE(std::filesystem::exists(*find_shared("robots", "limo"))) << "in the source tree";
}

}  // namespace
}  // namespace waymark
