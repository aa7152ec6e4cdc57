#include "tests/support/golden_page.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>

namespace waymark::testing {
namespace {

constexpr std::string_view kEntry = "=== ";

/// "Suite.Test" for the first call of a test, then "Suite.Test 2" and so on.
std::string next_entry() {
  static std::map<std::string, int, std::less<>> calls;
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  if (info == nullptr) {
    ADD_FAILURE() << "expect_on_page() outside of a test";
    return {};
  }
  const std::string name = std::string(info->test_suite_name()) + "." + info->name();
  const int call = ++calls[name];
  return call == 1 ? name : name + " " + std::to_string(call);
}

std::map<std::string, std::string, std::less<>> read_page(const std::filesystem::path& file) {
  std::map<std::string, std::string, std::less<>> entries;
  std::ifstream in(file);
  std::string* entry = nullptr;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(kEntry)) {
      entry = &entries[line.substr(kEntry.size())];
    } else if (entry != nullptr) {
      *entry += line + "\n";
    }
  }
  return entries;
}

/// One file per entry, because ctest runs tests concurrently; tools/update_pages.py merges the files.
void write_part(const std::filesystem::path& folder, std::string_view page, const std::string& entry,
                const std::string& text) {
  std::string leaf = std::string(page) + "@" + entry;
  std::ranges::replace(leaf, '/', '_');
  std::filesystem::create_directories(folder);
  std::ofstream(folder / leaf) << page << "\n" << kEntry << entry << "\n" << text;
}

}  // namespace

std::string masked(std::string_view text) {
  static const std::string kProject = std::filesystem::path(WAYMARK_TEST_PAGES).parent_path().parent_path();
  static const std::regex kTemporary("/tmp/waymark-[^/ ':,]*");
  static const std::regex kNumber(
      R"((^|[^A-Za-z0-9_#])[-+]?[0-9]+(\.[0-9]+)?(e[-+]?[0-9]+)?(?![0-9]*[A-Za-z_]))");
  std::string paths = std::regex_replace(std::string(text), kTemporary, "FOLDER");
  for (std::size_t at = paths.find(kProject); at != std::string::npos; at = paths.find(kProject, at))
    paths.replace(at, kProject.size(), "PROJECT");
  return std::regex_replace(paths, kNumber, "$1#");
}

void expect_on_page(std::string_view page, std::string_view text) {
  std::string shown = masked(text);
  if (!shown.ends_with('\n')) shown += '\n';
  shown += '\n';
  const std::string entry = next_entry();
  if (const char* folder = std::getenv("WAYMARK_PAGES_OUT"); folder != nullptr) {
    write_part(folder, page, entry, shown);
    return;
  }
  const auto entries = read_page(std::filesystem::path(WAYMARK_TEST_PAGES) / (std::string(page) + ".txt"));
  const auto found = entries.find(entry);
  ASSERT_NE(found, entries.end()) << "tests/pages/" << page << ".txt has no entry '" << entry
                                  << "'. Run tools/update_pages.py. The text is:\n"
                                  << shown;
  EXPECT_EQ(found->second, shown) << "tests/pages/" << page << ".txt, entry '" << entry
                                  << "'. If the new words are right, run tools/update_pages.py.";
}

void expect_on_page(std::string_view page, const Error& error) {
  expect_on_page(page, std::string_view(to_string(error)));
}

}  // namespace waymark::testing
