#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace waymark::testing {

/// A path inside the real data in WAYMARK_DATA, or nothing if it is missing. With WAYMARK_REQUIRE_DATA set,
/// missing data is a test failure instead of a skip.
std::optional<std::filesystem::path> real_data(const std::string& relative);

/// A new empty folder for one test, removed by the next run of the same test. For use inside a test or its
/// SetUp: in SetUpTestSuite no test has a name yet, and concurrent processes would share the folder.
std::filesystem::path fresh_folder(const std::string& name);

}  // namespace waymark::testing

/// Binds `name` to the path of the real data, or skips the test with a message (fails with --require-data).
// NOLINTBEGIN(bugprone-macro-parentheses): a declared name cannot be in parentheses.
#define WAYMARK_REAL_DATA(name, relative)                                           \
  const auto name##_or_none = ::waymark::testing::real_data(relative);              \
  if (!name##_or_none) GTEST_SKIP() << "WAYMARK_DATA does not hold " << (relative); \
  const std::filesystem::path& name = *name##_or_none
// NOLINTEND(bugprone-macro-parentheses)
