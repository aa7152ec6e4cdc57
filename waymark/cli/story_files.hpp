#pragma once

#include <filesystem>
#include <future>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/cli/loop_steps.hpp"

/// The files of an operator's story: nothing that was there is written over.
namespace waymark::cli {

/// "lap.mcap", or "lap.2.mcap" where that is taken.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& stem);

/// A map that is made on a thread of its own and without a word, beside its folder: NAME.new. What a story
/// that was cut off left there is removed.
class MapInTheMaking {
 public:
  void begin(const std::string& lap, const std::filesystem::path& folder);
  /// Begun and not taken.
  [[nodiscard]] bool under_way() const { return made_.valid(); }
  [[nodiscard]] bool ready() const;
  /// Waits for the map and puts it in its place. What was there becomes NAME.1, or the next number that is
  /// free; where that is, or empty when nothing was there.
  [[nodiscard]] Result<std::string> take();
  /// Since it was begun.
  [[nodiscard]] double seconds() const { return watch_.seconds(); }

 private:
  std::filesystem::path folder_{};
  std::future<Status> made_{};
  Stopwatch watch_{};
};

}  // namespace waymark::cli
