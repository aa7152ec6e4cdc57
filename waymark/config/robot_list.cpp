#include "waymark/config/robot_list.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {

Result<std::vector<ListedFile>> list_shared(std::string_view folder) {
  const auto share = share_folder();
  if (!share) return tl::unexpected(share.error());
  std::vector<ListedFile> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(*share / folder, error))
    if (entry.path().extension() == ".yaml") files.push_back({entry.path().stem().string(), entry.path()});
  if (error)
    return fail(ErrorCode::NotFound, "the files cannot be listed: " + error.message(),
                {.source = (*share / folder).string()});
  std::ranges::sort(files, {}, &ListedFile::name);
  return files;
}

std::string leading_comment(std::string_view yaml) {
  std::string text;
  while (yaml.starts_with('#')) {
    const std::size_t end = std::min(yaml.find('\n'), yaml.size());
    std::string_view line = yaml.substr(1, end - 1);
    while (line.starts_with(' ')) line.remove_prefix(1);
    while (line.ends_with(' ') || line.ends_with('\r')) line.remove_suffix(1);
    if (!text.empty() && !line.empty()) text += ' ';
    text += line;
    yaml.remove_prefix(std::min(end + 1, yaml.size()));
  }
  return text;
}

std::string first_sentence(const std::string& text) {
  const std::size_t end = text.find(". ");
  return end == std::string::npos ? text : text.substr(0, end + 1);
}

Result<CommentedRobot> read_commented_robot(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  auto robot = read_robot(path);
  if (!robot) return tl::unexpected(robot.error());
  const auto text = read_text_file(path, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  return CommentedRobot{std::move(*robot), leading_comment(*text)};
}

Result<RobotDescription> read_named_robot(const std::string& name) {
  const auto path = find_shared("robots", name);
  return path ? read_robot(*path) : tl::unexpected(path.error());
}

}  // namespace waymark
