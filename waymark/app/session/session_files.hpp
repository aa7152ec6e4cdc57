#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <string>

#include "waymark/base/error.hpp"

/// The files of an operator's session: nothing that was there is written over.
namespace waymark {

/// "lap.mcap", or "lap.2.mcap" where that is taken.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& stem);

/// Makes a map of a recorded lap in a folder; without a word, on whatever thread it is called.
using MapMaker = std::function<Status(const std::string& lap, const std::filesystem::path& folder)>;

/// A map that is made on a thread of its own beside its folder: NAME.new. What a session that was cut off
/// left there is removed.
class MapInTheMaking {
 public:
  void begin(const MapMaker& make, const std::string& lap, const std::filesystem::path& folder);
  /// Begun and not taken.
  [[nodiscard]] bool under_way() const { return made_.valid(); }
  [[nodiscard]] bool ready() const;
  /// Waits for the map and puts it in its place. What was there becomes NAME.1, or the next number that is
  /// free; where that is, or empty when nothing was there.
  [[nodiscard]] Result<std::string> take();
  /// Since it was begun.
  [[nodiscard]] double seconds() const;

 private:
  std::filesystem::path folder_{};
  std::future<Status> made_{};
  std::chrono::steady_clock::time_point began_{};
};

}  // namespace waymark
