#include "waymark/app/world/export_world.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/sdf/write_sdf.hpp"

namespace waymark {

namespace {

/// Sets the anchor in the report to that of the world if it has one, else to its first tag.
void set_anchor(const World& world, ExportWorldReport& report) {
  const auto& tags = world.tags.tags;
  auto anchor = tags.find(world.anchor);
  if (anchor == tags.end()) anchor = tags.begin();
  if (anchor == tags.end()) return;
  report.anchor = to_string(anchor->first);
  report.tag_size_m = anchor->second.size_m;
}

}  // namespace

Result<ExportWorldReport> export_world(const ExportWorldJob& job) {
  if (Status status = check_new_folder(job.folder); !status) return tl::unexpected(status.error());
  const SdfFiles sdf = write_sdf_world(job.world, job.robot);
  Result<StagedFolder> folder = StagedFolder::open(job.folder);
  if (!folder) return tl::unexpected(folder.error());
  ExportWorldReport report{.notes = sdf.notes, .tags = sdf.textures.size()};
  set_anchor(job.world, report);
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
  const std::string text = fmt::format(
      "{}: world with {} tags, robot and Gazebo profile\n"
      "Start Gazebo Fortress with it: ign gazebo -r {}\n",
      folder.string(), report.tags, shell_word((folder / "world.sdf").string()));
  if (report.anchor.empty())
    return text + "Drive in it:                   not possible: the world has no tag to use as anchor\n";
  return text + fmt::format(
                    "Drive in it:                   waymark teach --robot gazebo:{} --driver keyboard "
                    "--anchor {} --tag-size-m {:g} -o lap.mcap\n",
                    shell_word((folder / "gazebo.yaml").string()), report.anchor, report.tag_size_m);
}

ReportFields fields(const ExportWorldReport& report) {
  return {{"tags", "Number of tags", report.tags},
          {"files", "Names of the files in the folder", report.files},
          {"notes", "Differences between the world and its SDF", report.notes}};
}

}  // namespace waymark
