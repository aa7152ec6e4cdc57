#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/robot_file.hpp"

namespace waymark {

/// A file among those that come with Waymark.
struct ListedFile {
  std::string name{};
  std::filesystem::path path{};
};

/// The YAML files in a folder ("robots", "ros2") of the share folder, by name. Fails when it is not there.
[[nodiscard]] Result<std::vector<ListedFile>> list_shared(std::string_view folder);

/// What the lines of comment at the begin of a YAML file say, joined by spaces; where its facts are from.
[[nodiscard]] std::string leading_comment(std::string_view yaml);
/// Its first sentence.
[[nodiscard]] std::string first_sentence(const std::string& text);

/// A robot and what its file says in words: leading_comment().
struct CommentedRobot {
  RobotDescription robot;
  std::string comment{};
};
[[nodiscard]] Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path);

/// The robot of this name, or of the file at this path.
[[nodiscard]] Result<RobotDescription> read_named_robot(const std::string& name);

}  // namespace waymark
