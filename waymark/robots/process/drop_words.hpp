#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace waymark {

/// What people are told of messages that are dropped: of the 1st, 3rd, 10th, 30th, … of a topic, and of each
/// with a new reason. Numbers do not make a reason new.
class DropWords {
 public:
  /// Of one more message; nothing where it is not worth saying. Of many topics and reasons only the first
  /// hundred are told apart.
  [[nodiscard]] std::string add(const std::string& topic, std::string_view why);

 private:
  std::map<std::string, std::uint64_t> dropped_of_{};
  std::set<std::string> reasons_{};
};

}  // namespace waymark
