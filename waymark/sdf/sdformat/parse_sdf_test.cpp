#include "waymark/sdf/sdformat/parse_sdf.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ParseSdf : public ::testing::Test {
 protected:
  Result<SdfScene> parsed(const std::string& text) {
    const fs::path file = folder_ / "w.sdf";
    std::ofstream(file) << text;
    return parse_sdf(file, {folder_});
  }
  const fs::path folder_ = testing::fresh_folder("sdf");
};

TEST_F(ParseSdf, ComposesWorldPosesOfLinksFramesAndModels) {
  const auto scene = parsed(R"(<sdf version='1.9'><world name='w'>
    <model name='outer'><static>true</static><pose>1 0 0 0 0 1.5707963267948966</pose><link name='l'><pose>2 0 0 0 0 0</pose>
      <visual name='v'><pose>0 3 0 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry></visual></link>
      <frame name='f'><pose>0 0 5 0 0 0</pose></frame>
      <model name='inner'><pose relative_to='f'/><link name='l'><visual name='v'><geometry><sphere><radius>0.5</radius></sphere></geometry></visual></link></model>
    </model><light type='spot' name='s'><pose>1 2 3 0 0 0</pose><intensity>2</intensity></light></world></sdf>)");
  ASSERT_TRUE(scene) << to_string(scene.error());
  EXPECT_THAT(scene->warnings, IsEmpty());
  ASSERT_EQ(scene->visuals.size(), 2U);
  const SdfVisual& box = scene->visuals[0];
  EXPECT_EQ(box.name, "outer::l::v");
  EXPECT_EQ(box.shape, SdfShape::Box);
  EXPECT_TRUE(box.fixed);
  EXPECT_LT((box.world_T_visual.translation() - Eigen::Vector3d(-2, 2, 0)).norm(), 1e-12);
  EXPECT_LT((scene->visuals[1].world_T_visual.translation() - Eigen::Vector3d(1, 0, 5)).norm(), 1e-12);
  EXPECT_EQ(scene->visuals[1].name, "outer::inner::l::v");
  ASSERT_EQ(scene->lights.size(), 1U);
  EXPECT_EQ(scene->lights[0].kind, "spot");
  EXPECT_EQ(scene->lights[0].intensity, 2);
}

TEST_F(ParseSdf, ASingleModelIsAScene) {
  const auto scene = parsed("<sdf version='1.6'><model name='m'><link name='l'/></model></sdf>");
  ASSERT_TRUE(scene) << to_string(scene.error());
  EXPECT_EQ(scene->name, "m");
  EXPECT_EQ(scene->models.size(), 1U);
}

TEST_F(ParseSdf, MissingFilesAreWarningsAndInvalidSdfIsAnError) {
  const auto scene =
      parsed(R"(<sdf version='1.9'><world name='w'><include><uri>model://missing</uri></include>
    <model name='m'><link name='l'><visual name='v'><geometry><mesh><uri>gone.dae</uri></mesh></geometry></visual></link></model></world></sdf>)");
  ASSERT_TRUE(scene) << to_string(scene.error());
  EXPECT_THAT(scene->warnings, Contains(HasSubstr("model://missing")));
  EXPECT_THAT(scene->warnings, Contains(HasSubstr("gone.dae")));
  const auto text = parsed("<sdf version='1.9'>\n<world\n");
  ASSERT_FALSE(text);
  EXPECT_GE(text.error().place.line.value_or(0), 1);
  EXPECT_FALSE(parsed("<html/>"));
}

TEST_F(ParseSdf, SearchesNamesInTheFoldersInOrder) {
  fs::create_directories(folder_ / "a/board");
  fs::create_directories(folder_ / "b/board");
  std::ofstream(folder_ / "b/board/t.png") << "x";
  const std::vector<fs::path> folders = {folder_ / "a", folder_ / "b"};
  EXPECT_EQ(resolve_uri("model://board/t.png", folders), folder_ / "b/board/t.png");
  EXPECT_EQ(resolve_uri("file://board", folders), folder_ / "a/board");
  EXPECT_EQ(resolve_uri((folder_ / "b/board/t.png").string(), {}), folder_ / "b/board/t.png");
  EXPECT_TRUE(resolve_uri("model://none", folders).empty());
  EXPECT_TRUE(resolve_uri("", folders).empty());
}

}  // namespace
}  // namespace waymark
