#include "tests/support/data.hpp"

#include <cstdlib>

#include <gtest/gtest.h>

namespace waymark::testing {

std::optional<std::filesystem::path> real_data(const std::string& relative) {
  const char* folder = std::getenv("WAYMARK_DATA");
  if (folder != nullptr) {
    const auto path = std::filesystem::path(folder) / relative;
    if (std::filesystem::exists(path)) return path;
  }
  if (std::getenv("WAYMARK_REQUIRE_DATA") != nullptr) {
    ADD_FAILURE() << "--require-data, but WAYMARK_DATA does not hold " << relative;
  }
  return std::nullopt;
}

std::filesystem::path fresh_folder(const std::string& name) {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  if (info == nullptr) ADD_FAILURE() << "fresh_folder(\"" << name << "\") outside of a test";
  const std::string test = info == nullptr ? "" : std::string(info->test_suite_name()) + "." + info->name();
  std::string leaf = "waymark-" + test + "-" + name;
  for (char& c : leaf) {
    if (c == '/') c = '_';
  }
  const auto path = std::filesystem::temp_directory_path() / leaf;
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  return path;
}

}  // namespace waymark::testing
