#include "waymark/app/cli/folded_warnings.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

namespace waymark {
namespace {

/// Every number as one sign.
std::string kind_of(const std::string& warning) {
  std::string kind;
  const auto in_number = [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+'; };
  for (const char c : warning) {
    if (!in_number(c))
      kind += c;
    else if (kind.empty() || kind.back() != '#')
      kind += '#';
  }
  return kind;
}

}  // namespace

std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings) {
  constexpr std::size_t kFirst = 3;
  std::vector<std::vector<const std::string*>> kinds;
  std::map<std::string, std::size_t> at;
  for (const std::string& warning : warnings) {
    const auto [kind, added] = at.try_emplace(kind_of(warning), kinds.size());
    if (added) kinds.emplace_back();
    kinds[kind->second].push_back(&warning);
  }
  std::vector<std::string> result;
  for (const auto& alike : kinds) {
    // One line more says as much as the count of one.
    const std::size_t said = alike.size() <= kFirst + 1 ? alike.size() : kFirst;
    for (std::size_t i = 0; i < said; ++i) result.push_back(*alike[i]);
    if (said < alike.size())
      result.push_back(
          fmt::format("{} more warnings differ from the last one in their numbers only: --json lists "
                      "all",
                      alike.size() - said));
  }
  return result;
}

}  // namespace waymark
