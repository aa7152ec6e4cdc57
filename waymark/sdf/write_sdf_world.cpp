#include "waymark/sdf/write_sdf_world.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "waymark/families/family.hpp"
#include "waymark/plot/text.hpp"
#include "waymark/sdf/sdf_text.hpp"
#include "waymark/sdf/write_sdf_robot.hpp"

namespace waymark {
namespace {

constexpr double kBoard_m = 0.01;     // of a tag without a board of its own
constexpr double kBefore_m = 0.0005;  // the tag before its board, so that the two are told apart
constexpr int kPixelsPerCell = 32;
constexpr double kWhite = 0.9;

std::string texture_name(const TagId& tag) {
  return fmt::format("{}_{}.png", to_string(tag.family), tag.number);
}

/// The tag on its white paper, kPixelsPerCell pixels a cell.
Image texture_of(const TagId& tag, double margin_cells) {
  const int cells = family(tag.family).total_width;
  const std::vector<std::uint8_t> bits = bitmap(tag);
  const auto margin_px = static_cast<int>(std::lround(margin_cells * kPixelsPerCell));
  const int side_px = cells * kPixelsPerCell + 2 * margin_px;
  Image image(side_px, side_px, 255);
  for (int y = 0; y < cells * kPixelsPerCell; ++y)
    for (int x = 0; x < cells * kPixelsPerCell; ++x) {
      const int cell = (y / kPixelsPerCell) * cells + x / kPixelsPerCell;
      const std::uint8_t level = bits[static_cast<std::size_t>(cell)];
      constexpr std::uint8_t kNotOfTheTag = 128;
      image.row(y + margin_px)[x + margin_px] = level == kNotOfTheTag ? std::uint8_t{255} : level;
    }
  return image;
}

/// A tag looks along -z of its own frame (x right, y down); a plane of SDF along +z, its picture's upper edge
/// at +y.
std::string tag_model(const std::string& name, const TagId& tag, const MappedTag& placed, double margin_cells,
                      bool with_board) {
  const Family& layout = family(tag.family);
  const double cell_m = placed.size_m / layout.width_at_border;
  const double paper_m = (layout.total_width + 2 * margin_cells) * cell_m;
  const SE3 tag_T_plane(SO3::from_rpy(M_PI, 0, 0), Eigen::Vector3d::Zero());
  std::string content = fmt::format(
      "        <visual name='tag'><geometry><plane><normal>0 0 1</normal><size>{0:.6f} "
      "{0:.6f}</size></plane></geometry>"
      "<material><diffuse>1 1 1 1</diffuse><specular>0 0 0 "
      "1</specular><pbr><metal><albedo_map>{1}</albedo_map>"
      "<metalness>0</metalness><roughness>1</roughness></metal></pbr></material></visual>\n",
      paper_m, texture_name(tag));
  if (with_board)
    content += sdf_text::solid("board", SE3({}, {0, 0, -kBefore_m - kBoard_m / 2}),
                               sdf_text::box({paper_m, paper_m, kBoard_m}), kWhite);
  return sdf_text::fixed_model(name, placed.map_T_tag * tag_T_plane, content);
}

/// The board between the two sides of a tag that is printed on both.
std::string board_model(const TagId& tag, const MappedTag& placed, const World& world) {
  const Family& layout = family(tag.family);
  const double paper_m =
      (layout.total_width + 2 * world.tag_margin_cells) * placed.size_m / layout.width_at_border;
  const double thick_m = std::max(1e-4, world.tag_board_m - 2 * kBefore_m);
  const std::string content =
      sdf_text::solid("board", SE3(), sdf_text::box({paper_m, paper_m, thick_m}), kWhite);
  return sdf_text::fixed_model(fmt::format("board_{}_{}", to_string(tag.family), tag.number),
                               placed.map_T_tag * SE3({}, {0, 0, world.tag_board_m / 2}), content);
}

std::string tags_of(const World& world, SdfFiles& files) {
  std::string text;
  std::set<TagId> drawn;
  std::set<TagId> on_panels;
  for (const Panel& panel : world.panels) on_panels.insert(panel.tags.begin(), panel.tags.end());
  int number = 0;
  for (const auto& [tag, placed] : readable_tags(world)) {
    const std::string name = fmt::format("{}_{}_{}", to_string(tag.family), tag.number, number++);
    text += tag_model(name, tag, placed, world.tag_margin_cells,
                      !(world.tag_board_m > 0) && !on_panels.contains(tag));
    if (drawn.insert(tag).second)
      files.textures.push_back({texture_name(tag), texture_of(tag, world.tag_margin_cells)});
  }
  if (world.tag_board_m > 0)
    for (const auto& [tag, placed] : world.tags.tags)
      if (!on_panels.contains(tag)) text += board_model(tag, placed, world);
  return text;
}

std::string scenery_of(const World& world) {
  std::string text;
  std::vector<Occluder> boxes = world.occluders;
  std::ranges::transform(world.walls, std::back_inserter(boxes), as_box);
  int number = 0;
  for (const Occluder& box : boxes)
    text += sdf_text::fixed_model(fmt::format("box_{}", number++),
                                  SE3(SO3::from_rpy(0, 0, box.yaw_rad), box.centre_m),
                                  sdf_text::solid("box", SE3(), sdf_text::box(box.size_m), box.reflectance));
  number = 0;
  for (const Panel& panel : world.panels) {
    const SE3 behind({}, {0, 0, kBefore_m + panel.thickness_m / 2});
    text += sdf_text::fixed_model(
        fmt::format("panel_{}", number++), panel.map_T_panel * behind,
        sdf_text::solid("panel", SE3(), sdf_text::box({panel.width_m, panel.height_m, panel.thickness_m}),
                        panel.reflectance));
  }
  return text;
}

/// Where the line begins, along it.
SE3 start_of(const World& world) {
  if (world.path_m.size() < 2) return {};
  const Eigen::Vector2d along = world.path_m[1] - world.path_m[0];
  return {SO3::from_rpy(0, 0, std::atan2(along.y(), along.x())),
          Eigen::Vector3d(world.path_m[0].x(), world.path_m[0].y(), 0)};
}

constexpr const char* kWorldPlugins =
    R"(    <physics name='1ms' type='ignored'><max_step_size>0.001</max_step_size><real_time_factor>1</real_time_factor></physics>
    <plugin filename='ignition-gazebo-physics-system' name='ignition::gazebo::systems::Physics'/>
    <plugin filename='ignition-gazebo-user-commands-system' name='ignition::gazebo::systems::UserCommands'/>
    <plugin filename='ignition-gazebo-scene-broadcaster-system' name='ignition::gazebo::systems::SceneBroadcaster'/>
    <plugin filename='ignition-gazebo-imu-system' name='ignition::gazebo::systems::Imu'/>
    <plugin filename='ignition-gazebo-sensors-system' name='ignition::gazebo::systems::Sensors'><render_engine>ogre2</render_engine></plugin>
    <scene><ambient>0.6 0.6 0.6 1</ambient><background>0.8 0.8 0.8 1</background><shadows>false</shadows></scene>
    <light type='directional' name='sun'><pose>0 0 10 0 0 0</pose><cast_shadows>false</cast_shadows><diffuse>0.5 0.5 0.5 1</diffuse><specular>0 0 0 1</specular><direction>-0.3 0.2 -0.9</direction></light>
)";

}  // namespace

std::string sdf_model_name(const std::string& name) {
  std::string plain = name;
  std::ranges::replace_if(
      plain, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return plain.empty() ? "robot" : plain;
}

SdfFiles write_sdf_world(const World& world, const RobotDescription& robot) {
  SdfFiles files;
  const std::string ground = "<geometry><plane><normal>0 0 1</normal><size>200 200</size></plane></geometry>";
  const std::string places =
      sdf_text::fixed_model("floor", SE3(),
                            sdf_text::solid("floor", SE3(), ground, world.floor.reflectance)) +
      scenery_of(world) + tags_of(world, files);
  files.world = fmt::format(
      "<?xml version='1.0'?>\n<!-- Written by Waymark for Gazebo Fortress. Frame world is the frame map. "
      "-->\n"
      "<sdf version='1.9'>\n  <world name='{1}'>\n{2}{3}{4}  </world>\n</sdf>\n",
      plot::escaped(world.name), sdf_model_name(world.name), kWorldPlugins, places,
      write_sdf_robot(robot, start_of(world), files.notes));
  return files;
}

}  // namespace waymark
