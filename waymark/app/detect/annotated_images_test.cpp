#include "waymark/app/detect/annotated_images.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::ElementsAre;

TEST(AnnotationNames, AreShortIfUnique) {
  EXPECT_THAT(annotation_names({"a/photo.jpg", "b/other.png"}), ElementsAre("photo.png", "other.png"));
}

TEST(AnnotationNames, ContainTheFolderIfNeeded) {
  EXPECT_THAT(annotation_names({"left/1.png", "../right/1.png", "/1.jpg", "2.png"}),
              ElementsAre("left__1.png.png", "right__1.png.png", "1.jpg.png", "2.png"));
}

TEST(AnnotationNames, AreNumberedIfPathsCollide) {
  EXPECT_THAT(annotation_names({"a/b.png", "../a/b.png", "A__B.PNG"}),
              ElementsAre("a__b.png.png", "a__b.png-2.png", "A__B.png"));
}

TEST(AnnotationNames, NeverCollideAndStayInTheFolder) {
  rc::check("any list of paths", [] {
    const auto part =
        rc::gen::element<std::string>("a", "A", "..", ".", "a.png", "a.jpg", "a-2", "a__a", "/");
    const auto path = rc::gen::map(rc::gen::container<std::vector<std::string>>(part), [](const auto& parts) {
      std::string joined = "a.png";
      for (const auto& p : parts) joined.insert(0, p + "/");
      return joined;
    });
    const auto paths = *rc::gen::container<std::vector<std::string>>(path);
    std::set<std::string> names;
    for (std::string name : annotation_names(paths)) {
      RC_ASSERT(name.find('/') == std::string::npos);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      RC_ASSERT(names.insert(name).second);
    }
  });
}

}  // namespace
}  // namespace waymark
