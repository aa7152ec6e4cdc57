#pragma once

#include <string>
#include <vector>

#include "waymark/live/doctor_tag_size.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flags --tag-at-m and --tag-size-m of the trial of a tag's printed size; of an app that has
/// --camera-source.
struct TagSizeFlags {
  explicit TagSizeFlags(CLI::App& app);
  TagSizeFlags(const TagSizeFlags&) = delete;
  TagSizeFlags& operator=(const TagSizeFlags&) = delete;

  /// By the pictures of each camera; nothing without --tag-at-m.
  [[nodiscard]] std::vector<DoctorLine> check(const std::vector<std::string>& sources,
                                              const std::string& calibration) const;

  TagSizeTrial trial{};
};

}  // namespace waymark::cli
