#pragma once

#include <limits>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flags --topics, --from and --to. Must stay where it is while the command line is parsed.
class SelectionFlags {
 public:
  explicit SelectionFlags(CLI::App& app);
  SelectionFlags(const SelectionFlags&) = delete;
  SelectionFlags& operator=(const SelectionFlags&) = delete;

  /// What was asked for, of this recording. Fails on a topic it does not have (with the nearest that it has)
  /// and on times that make no sense.
  [[nodiscard]] Result<LogSelection> make(MessageLog& log) const;

 private:
  std::vector<std::string> topics_;
  double from_s_ = 0;
  double to_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace waymark::cli
