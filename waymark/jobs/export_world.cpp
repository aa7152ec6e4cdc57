#include "waymark/jobs/export_world.hpp"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/jobs/shell_word.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/sdf/write_sdf_robot.hpp"
#include "waymark/sdf/write_sdf_world.hpp"

namespace waymark {

Result<ExportWorldReport> export_world(const ExportWorldJob& job) {
  if (Status status = check_new_folder(job.folder); !status) return tl::unexpected(status.error());
  const SdfFiles sdf = write_sdf_world(job.world, job.robot);
  Result<StagedFolder> folder = StagedFolder::open(job.folder);
  if (!folder) return tl::unexpected(folder.error());
  ExportWorldReport report{
      .notes = sdf.notes, .tags = sdf.textures.size(), .anchor = to_string(job.world.anchor)};
  if (const MappedTag* anchor = job.world.tags.find(job.world.anchor)) report.tag_size_m = anchor->size_m;
  const std::pair<const char*, std::string> texts[] = {
      {"world.sdf", sdf.world},
      {"robot.yaml", job.robot_yaml},
      {"gazebo.yaml", gazebo_profile_of(job.robot, "robot.yaml")}};
  for (const auto& [name, text] : texts) {
    if (Status status = write_text_file(folder->path() / name, text); !status)
      return folder->failed(status.error());
    report.files.emplace_back(name);
  }
  for (const SdfTexture& texture : sdf.textures) {
    if (Status status = write_image(folder->path() / texture.name, texture.image.view()); !status)
      return folder->failed(status.error());
    report.files.push_back(texture.name);
  }
  const auto moved = folder->put_in_place({});
  if (!moved) return tl::unexpected(moved.error());
  return report;
}

std::string to_text(const ExportWorldReport& report, const std::filesystem::path& folder) {
  return fmt::format(
      "{0}: a world with {1} tags, a robot and its profile\n"
      "Start Gazebo Fortress with it: ign gazebo -r {2}\n"
      "Drive in it:                   waymark teach --robot gazebo:{3} --driver keyboard --anchor {4} "
      "--tag-size-m {5:g} "
      "-o lap.mcap\n",
      folder.string(), report.tags, shell_word((folder / "world.sdf").string()),
      shell_word((folder / "gazebo.yaml").string()), report.anchor, report.tag_size_m);
}

nlohmann::ordered_json to_json(const ExportWorldReport& report) {
  return {{"tags", report.tags}, {"files", report.files}, {"notes", report.notes}};
}

}  // namespace waymark
