#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace waymark {

/// Reports dropped messages: the 1st, 3rd, 10th, 30th, … on each topic, and every new reason. Reasons that
/// differ only in their numbers count as the same.
class DropReports {
 public:
  /// Counts a dropped message and returns the report; empty if none is due. Only the first hundred topics and
  /// the first hundred reasons are tracked.
  [[nodiscard]] std::string add(const std::string& topic, std::string_view why);

 private:
  std::map<std::string, std::uint64_t> dropped_of_{};
  std::set<std::string> reasons_{};
};

}  // namespace waymark
