#include "waymark/modules/load_module.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include <gtest/gtest.h>

namespace waymark {
namespace {

class Module : public ::testing::Test {
 protected:
  [[nodiscard]] Result<void*> load() const {
    return load_module(
        {file_.c_str(), "waymark_no_such_function", "robots of glass", "libglass", "libglass-dev"});
  }
  [[nodiscard]] static std::filesystem::path folder() {
    return std::filesystem::read_symlink("/proc/self/exe").parent_path();
  }
  void TearDown() override { std::filesystem::remove(folder() / file_); }

  std::string file_ = "libwaymark-test-" + std::to_string(getpid()) + ".so";
};

TEST_F(Module, AMissingModuleIsAnErrorWithItsPurposeAndBuildPackage) {
  const auto missing = load();
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_NE(missing.error().message.find("robots of glass"), std::string::npos);
  EXPECT_NE(missing.error().hint.find("libglass-dev"), std::string::npos);
}

TEST_F(Module, ABrokenModuleIsAnErrorWithItsRuntimePackage) {
  std::ofstream(folder() / file_) << "no library";
  const auto broken = load();
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().code, ErrorCode::Unsupported);

  EXPECT_NE(broken.error().hint.find("libglass,"), std::string::npos);
}

TEST(SharedLibrary, ReportsMissingLibrariesAndSymbols) {
  SharedLibrary none("libwaymark-is-not-there.so.1");
  double (*cosine)(double) = [](double x) { return x; };
  none.look_up("cos", cosine);
  EXPECT_EQ(cosine, nullptr);
  EXPECT_NE(none.missing().find("libwaymark-is-not-there.so.1"), std::string::npos) << none.missing();
  SharedLibrary math("libm.so.6");
  math.look_up("cos", cosine);
  ASSERT_NE(cosine, nullptr) << math.missing();
  EXPECT_EQ(cosine(0), 1.0);
  EXPECT_EQ(math.missing(), "");
  math.look_up("waymark_cos", cosine);
  EXPECT_EQ(cosine, nullptr);
  EXPECT_NE(math.missing().find("libm.so.6"), std::string::npos) << math.missing();
  EXPECT_NE(math.missing().find("waymark_cos"), std::string::npos) << math.missing();
}

}  // namespace
}  // namespace waymark
