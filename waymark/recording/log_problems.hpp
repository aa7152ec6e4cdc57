#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Problems by their key, in the order they were first seen; what happens often is counted, not repeated.
class LogProblems {
 public:
  /// The words are made only for the first of a kind: `words()` gives the Error.
  template <class Words>
  void add(LogProblem::Kind kind, std::string_view key, Words&& words, std::uint64_t count = 1) {
    const auto known = std::ranges::find(list_, key, &LogProblem::key);
    if (known != list_.end()) {
      known->count += count;
    } else {
      list_.push_back({kind, std::string(key), std::forward<Words>(words)(), count});
    }
  }
  template <class Words>
  void damage(std::string_view key, Words&& words) {
    add(LogProblem::Kind::Damage, key, std::forward<Words>(words));
  }
  template <class Words>
  void trap(std::string_view key, Words&& words, std::uint64_t count = 1) {
    add(LogProblem::Kind::Trap, key, std::forward<Words>(words), count);
  }
  /// Each with its own words.
  void damages(std::string_view key, const std::vector<Error>& errors) {
    for (const Error& error : errors) list_.push_back({LogProblem::Kind::Damage, std::string(key), error, 1});
  }

  void clear() { list_.clear(); }
  [[nodiscard]] const std::vector<LogProblem>& list() const { return list_; }
  void append_to(std::vector<LogProblem>& out) const { out.insert(out.end(), list_.begin(), list_.end()); }

 private:
  std::vector<LogProblem> list_;
};

/// What was found when a log was opened, then what the last visit found.
[[nodiscard]] inline std::vector<LogProblem> joined(const LogProblems& opened, const LogProblems& visited) {
  std::vector<LogProblem> all = opened.list();
  visited.append_to(all);
  return all;
}

}  // namespace waymark
