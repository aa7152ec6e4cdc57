#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A recording that has just been begun: unless the robot said something, or keep() was called, it is removed
/// again, so that it does not stand in the way of the next attempt.
class FreshFile {
 public:
  /// Empty: no file.
  explicit FreshFile(std::string path) : path_(std::move(path)) {}
  FreshFile(const FreshFile&) = delete;
  FreshFile& operator=(const FreshFile&) = delete;
  ~FreshFile() {
    std::error_code ignored;
    if (!path_.empty() && !kept_ && std::filesystem::is_regular_file(path_, ignored))
      std::filesystem::remove(path_, ignored);
  }

  /// What was sent to the robot does not count.
  void receive(const Sample& sample) { kept_ = kept_ || !std::holds_alternative<StampedCommand>(sample); }
  void keep() { kept_ = true; }
  /// Nothing was driven, whatever the robot said.
  void discard() { kept_ = false; }

 private:
  std::string path_;
  bool kept_ = false;
};

}  // namespace waymark
