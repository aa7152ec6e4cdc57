#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace waymark::testing {

/// A path inside the real data of WAYMARK_DATA; nothing if it does not exist. With WAYMARK_REQUIRE_DATA,
/// missing data fail the test instead of skipping it.
std::optional<std::filesystem::path> real_data(const std::string& relative);

/// A new empty folder for one test, removed by the next run of the same test. Call it in a test or its SetUp:
/// in SetUpTestSuite no test has a name yet, and concurrent processes would share the folder.
std::filesystem::path fresh_folder(const std::string& name);

}  // namespace waymark::testing

/// Binds `name` to the path of the real data, or skips the test with a message (fails with --require-data).
// NOLINTBEGIN(bugprone-macro-parentheses): a declared name cannot be in parentheses.
#define WAYMARK_REAL_DATA(name, relative)                                           \
  const auto name##_or_none = ::waymark::testing::real_data(relative);              \
  if (!name##_or_none) GTEST_SKIP() << "WAYMARK_DATA does not hold " << (relative); \
  const std::filesystem::path& name = *name##_or_none
// NOLINTEND(bugprone-macro-parentheses)
