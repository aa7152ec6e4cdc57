#include "waymark/config/exchange/map_exchange.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/exchange/xyz.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kExchangeLimits{.bytes = std::size_t{1} << 26U, .nodes = 2'000'000, .depth = 16};

/// A pose from position and rotation vector, with standard deviations along its own axes if they are given.
Result<Uncertain<SE3>> tagslam_pose(const YamlCursor& at) {
  const auto p = at.read_at("position", read_xyz);
  if (!p) return tl::unexpected(p.error());
  const auto r = at.read_at("rotation", read_xyz);
  if (!r) return tl::unexpected(r.error());
  Uncertain<SE3> pose{SE3(SO3::exp(*r), *p)};
  if (!at.find("position_noise") || !at.find("rotation_noise")) return pose;
  const auto sigma_m = at.read_at("position_noise", read_xyz);
  if (!sigma_m) return tl::unexpected(sigma_m.error());
  const auto sigma_rad = at.read_at("rotation_noise", read_xyz);
  if (!sigma_rad) return tl::unexpected(sigma_rad.error());
  Eigen::Matrix<double, 6, 1> variance;
  variance << sigma_m->cwiseAbs2(), sigma_rad->cwiseAbs2();
  const auto Ad = pose.mean.adjoint();
  pose.covariance = Ad * variance.asDiagonal() * Ad.transpose();
  return pose;
}

Result<double> size_of(const YamlCursor& at, std::string_view key, std::optional<double> fallback) {
  const auto found = at.find(key);
  if (!found && fallback) return *fallback;
  const Result<double> size = at.read_at(key, &YamlCursor::number);
  if (!size) return size;
  if (!is_tag_size(*size))
    return found->fail_here(ErrorCode::InvalidArgument,
                            fmt::format("a tag size of {:g} m is not greater than 0", *size));
  return size;
}

Status add_tag(const YamlCursor& at, const TagId& id, const MappedTag& tag, ReadMap& map) {
  if (map.map.tags.tags.emplace(id, tag).second) return {};
  return at.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is given twice", to_string(id)));
}

Status read_body(const YamlCursor& body, std::optional<double> tag_size_m, ReadMap& map) {
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  const auto pose = body.find("pose");
  Uncertain<SE3> map_T_body;
  if (pose) {
    const auto read = tagslam_pose(*pose);
    if (!read) return tl::unexpected(read.error());
    map_T_body = *read;
  }
  std::optional<double> usual = tag_size_m;
  if (body.find("default_tag_size")) {
    const Result<double> size = size_of(body, "default_tag_size", {});
    if (!size) return tl::unexpected(size.error());
    usual = *size;
  }
  const auto tags = body.find("tags");
  if (!tags) return {};
  for (const YamlCursor& entry : tags->children()) {
    const auto id = entry.read_at("id", [](const YamlCursor& c) { return c.integer(0, 1'000'000); });
    if (!id) return tl::unexpected(id.error());
    const auto at = entry.find("pose");
    if (!at) {
      map.warnings.push_back(fmt::format("tag {} has no pose; skipped", *id));
      continue;
    }
    const auto body_T_tag = tagslam_pose(*at);
    if (!body_T_tag) return tl::unexpected(body_T_tag.error());
    const Result<double> size = size_of(entry, "size", usual);
    if (!size) return tl::unexpected(size.error());
    const Uncertain<SE3> placed = compose(map_T_body, *body_T_tag);
    MappedTag tag{.map_T_tag = placed.mean * half_turn, .size_m = *size};
    constexpr double kExact = 1e-10;
    if (placed.covariance.diagonal().maxCoeff() > kExact) tag.covariance = placed.covariance;
    const TagId name{FamilyId::Tag36h11, static_cast<int>(*id)};
    if (Status status = add_tag(entry, name, tag, map); !status) return status;
  }
  return {};
}

/// Names the family of tags that were read without one.
void name_tagslam_family(TagMap& map) {
  const FamilyId family = usual_family(map.tags.empty() ? -1 : map.tags.rbegin()->first.number);
  std::map<TagId, MappedTag> named;
  for (const auto& [id, tag] : map.tags) named.emplace(TagId{family, id.number}, tag);
  map.tags = std::move(named);
}

/// Reads the tags on static bodies with known poses.
Result<ReadMap> read_tagslam_map(const YamlCursor& root, std::optional<double> tag_size_m) {
  ReadMap map{.form = MapForm::Tagslam};
  const Result<YamlCursor> bodies = root.at("bodies");
  if (!bodies) return tl::unexpected(bodies.error());
  for (const YamlCursor& named : bodies->children()) {
    if (!named.is_map() || named.children().empty())
      return named.fail_here(ErrorCode::Unreadable, "a body must be `- NAME:` with its keys below");
    const YamlCursor body = named.children().front();
    const std::string& name = named.node().keys.front();
    const auto fixed = body.find("is_static");
    const Result<bool> is_static = fixed ? fixed->boolean() : Result<bool>(true);
    if (!is_static) return tl::unexpected(is_static.error());
    if (!*is_static) {
      if (body.find("tags")) map.warnings.push_back(fmt::format("body {} moves; its tags are skipped", name));
      continue;
    }
    if (Status status = read_body(body, tag_size_m, map); !status) return tl::unexpected(status.error());
  }
  name_tagslam_family(map.map.tags);
  return map;
}

/// Reads transforms whose child frame is a tag ("tag36h11:7").
Result<ReadMap> read_transforms(const YamlCursor& root, std::optional<double> tag_size_m) {
  ReadMap map{.form = MapForm::Transforms};
  if (!tag_size_m)
    return fail(ErrorCode::InvalidArgument, "transforms do not contain the tag size",
                {.source = root.source()}, "Set `tag_size_m`, the side of the black square.");
  const Result<YamlCursor> transforms = root.at("transforms");
  if (!transforms) return tl::unexpected(transforms.error());
  for (const YamlCursor& entry : transforms->children()) {
    const Result<std::string> child = entry.read_at("child_frame_id", &YamlCursor::text);
    if (!child) return tl::unexpected(child.error());
    const Result<TagId> id = parse_tag_id(*child);
    if (!id) {
      map.warnings.push_back(fmt::format("'{}' is not a tag frame such as tag36h11:7; skipped", *child));
      continue;
    }
    const Result<YamlCursor> transform = entry.at("transform");
    if (!transform) return tl::unexpected(transform.error());
    const auto p = transform->read_at("translation", read_xyz);
    if (!p) return tl::unexpected(p.error());
    const Result<YamlCursor> turn = transform->at("rotation");
    if (!turn) return tl::unexpected(turn.error());
    const auto q = read_xyz(*turn);
    if (!q) return tl::unexpected(q.error());
    const Result<double> w = turn->read_at("w", &YamlCursor::number);
    if (!w) return tl::unexpected(w.error());
    const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(*w, q->x(), q->y(), q->z()));
    if (!rotation) return turn->fail_here(rotation.error().code, rotation.error().message);
    const MappedTag tag{.map_T_tag = SE3(*rotation, *p), .size_m = *tag_size_m};
    if (Status status = add_tag(entry, *id, tag, map); !status) return tl::unexpected(status.error());
  }
  return map;
}

Result<ReadMap> read_known(std::string_view text, const std::string& source,
                           std::optional<double> tag_size_m) {
  if (text.find("waymark-map") != std::string_view::npos) {
    Result<MapFile> map = parse_map(text, source);
    if (!map) return tl::unexpected(map.error());
    return ReadMap{.map = std::move(*map)};
  }
  if (looks_like_wpilib_layout(text)) {
    Result<TagMap> layout = parse_wpilib_layout(text, source, tag_size_m);
    if (!layout) return tl::unexpected(layout.error());
    ReadMap read{.map = {.tags = std::move(*layout)}, .form = MapForm::Wpilib, .field = field_size_of(text)};
    if (!tag_size_m) read.warnings.push_back(note_of_assumed_size(source, kWpilibTagSize_m));
    return read;
  }
  if (looks_like_fmap(text)) {
    Result<TagMap> field = parse_fmap(text, source);
    if (!field) return tl::unexpected(field.error());
    return ReadMap{.map = {.tags = std::move(*field)}, .form = MapForm::Fmap, .field = field_size_of(text)};
  }
  const Result<YamlNode> tree = parse_yaml(text, source, kExchangeLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (root.is_map() && root.find("bodies")) return read_tagslam_map(root, tag_size_m);
  if (root.is_map() && root.find("transforms")) return read_transforms(root, tag_size_m);
  const Result<LandmarksFile> other = parse_landmarks(text, source, tag_size_m);
  if (!other) return tl::unexpected(other.error());
  if (other->tags.tags.empty())
    return fail(ErrorCode::Unsupported, "this is a map of points without orientation", {.source = source});
  return ReadMap{.map = {.tags = other->tags}, .form = MapForm::Academy, .warnings = other->notes};
}

}  // namespace

Result<ReadMap> parse_any_map(std::string_view text, const std::string& source,
                              std::optional<double> tag_size_m) {
  if (tag_size_m && !is_tag_size(*tag_size_m))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a tag size of {:g} m is not greater than 0", *tag_size_m), {.key = "tag_size_m"},
                "Give the side of the black square in metres.");
  Result<ReadMap> read = read_known(text, source, tag_size_m);
  if (!read || read->form == MapForm::Waymark) return read;
  if (read->map.tags.tags.empty())
    return fail(ErrorCode::NotFound, "contains no tag with a pose", {.source = source});
  read->map.anchor = read->map.tags.tags.begin()->first;
  return read;
}

Result<ReadMap> read_any_map(const std::filesystem::path& path, std::optional<double> tag_size_m) {
  const std::filesystem::path file = map_file_of(path);
  const Result<std::string> text = read_text_file(file, kExchangeLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_any_map(*text, file.string(), tag_size_m);
}

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Heading of a robot that faces the tag, and the centre of its board.
std::string academy_yaml(const MapFile& map, std::vector<std::string>& warnings) {
  constexpr double kLeans = 0.05;
  constexpr double kHalfBoard = 0.01;
  std::string text = "tags:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const Eigen::Vector3d into = tag.map_T_tag.rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d down = tag.map_T_tag.rotation() * Eigen::Vector3d::UnitY();
    if (std::abs(into.z()) > kLeans || std::abs(down.z() + 1) > kLeans)
      warnings.push_back(to_string(id) + " is not upright, which this form cannot represent");
    const double yaw = std::atan2(into.y(), into.x());
    const Eigen::Vector3d p =
        tag.map_T_tag.translation() + kHalfBoard * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
    text += fmt::format("  tag_{}:\n    position: {}\n", id.number,
                        yaml_list(std::vector{p.x(), p.y(), p.z(), yaw}));
  }
  return text;
}

std::string tagslam_yaml(const MapFile& map) {
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  std::string text = "bodies:\n - lab:\n     type: simple\n     is_static: true\n     pose:\n" +
                     xyz_lines("position", Eigen::Vector3d::Zero(), "       ") +
                     xyz_lines("rotation", Eigen::Vector3d::Zero(), "       ") +
                     xyz_lines("position_noise", Eigen::Vector3d::Constant(1e-6), "       ") +
                     xyz_lines("rotation_noise", Eigen::Vector3d::Constant(1e-6), "       ") + "     tags:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const SE3 pose = tag.map_T_tag * half_turn;
    // TagSLAM defines the error in the axes of the pose itself.
    Vector6d sigma = Vector6d::Constant(1e-6);
    if (tag.covariance) {
      const auto own = inverse(Uncertain<SE3>{pose, *tag.covariance}).covariance;
      sigma = own.diagonal().cwiseMax(1e-12).cwiseSqrt();
    }
    text += fmt::format("       - id: {}\n         size: {}\n         pose:\n", id.number,
                        yaml_number(tag.size_m)) +
            xyz_lines("position", pose.translation(), "           ") +
            xyz_lines("rotation", pose.rotation().log(), "           ") +
            xyz_lines("position_noise", sigma.head<3>(), "           ") +
            xyz_lines("rotation_noise", sigma.tail<3>(), "           ");
  }
  return text;
}

std::string transforms_yaml(const MapFile& map) {
  std::string text = "transforms:\n";
  for (const auto& [id, tag] : map.tags.tags) {
    const Eigen::Quaterniond& q = tag.map_T_tag.rotation().quaternion();
    text += fmt::format("  - header:\n      frame_id: map\n    child_frame_id: {}\n    transform:\n",
                        yaml_text(to_string(id)));
    text += xyz_lines("translation", tag.map_T_tag.translation(), "      ") +
            xyz_lines("rotation", Eigen::Vector3d(q.x(), q.y(), q.z()), "      ") +
            fmt::format("        w: {}\n", yaml_number(q.w()));
  }
  return text;
}

}  // namespace

std::vector<std::string> map_form_names() {
  return {"waymark", "academy", "tagslam", "tf", "wpilib", "fmap"};
}

Result<MapForm> map_form(const std::string& name) {
  const std::vector<std::string> names = map_form_names();
  const auto at = std::ranges::find(names, name);
  if (at == names.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown map form '{}'", name), {.key = "to"},
                suggestion(name, names));
  return static_cast<MapForm>(at - names.begin());
}

Result<std::string> to_text(const MapFile& map, MapForm form, std::vector<std::string>& warnings,
                            const std::optional<FieldSize>& field) {
  if (map.tags.tags.empty()) return fail(ErrorCode::InvalidArgument, "the map has no tags");
  if (form == MapForm::Waymark) return to_yaml(map);
  std::set<int> numbers;
  bool certain = true;
  for (const auto& [id, tag] : map.tags.tags) {
    const bool once = numbers.insert(static_cast<int>(id.number)).second;
    if (!once && form != MapForm::Transforms && form != MapForm::Fmap)
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("two tags of the map have id {}, but this form has no families", id.number));
    certain = certain && !tag.covariance;
  }
  if (!certain && form != MapForm::Tagslam)
    warnings.emplace_back("this form cannot hold covariances; omitted");
  if (form != MapForm::Tagslam && form != MapForm::Fmap)
    warnings.emplace_back("this form cannot hold the tag size; omitted");
  switch (form) {
    case MapForm::Academy:
      return academy_yaml(map, warnings);
    case MapForm::Tagslam:
      return tagslam_yaml(map);
    case MapForm::Wpilib:
      if (!field)
        warnings.emplace_back(
            "the map does not contain the field size; the layout uses the bounding box of the tags");
      return to_wpilib_layout(map.tags, field);
    case MapForm::Fmap:
      return to_fmap(map.tags, field);
    default:
      return transforms_yaml(map);
  }
}

}  // namespace waymark
