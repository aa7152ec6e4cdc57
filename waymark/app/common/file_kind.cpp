#include "waymark/app/common/file_kind.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <initializer_list>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/json_text.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/recording/compression.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

constexpr std::size_t kFileHeadBytes = std::size_t{1} << 16U;

std::string_view trimmed(std::string_view text, std::string_view blanks = " \t\r\"") {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

std::vector<std::string_view> parts_of(std::string_view line, std::string_view separators) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t end = std::min(line.find_first_of(separators), line.size());
    words.push_back(trimmed(line.substr(0, end)));
    if (end == line.size()) return words;
    line.remove_prefix(end + 1);
  }
}

bool is_number(std::string_view word) {
  double value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// Whether a word may be the name of a column, such as "x_m" or "Z-Rotation".
bool is_column(std::string_view word) {
  return !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
    return c == '_' || c == '-' || c >= 0x80 || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
           (c >= 'A' && c <= 'Z');
  });
}

/// The beginning of a file, and those parts of it that several rows of the table use.
class FileHead {
 public:
  FileHead(fs::path path, bool folder, std::string_view bytes, std::uint64_t size)
      : path_(std::move(path)), folder_(folder), bytes_(bytes) {
    log_ = format_of_head(as_bytes(bytes_), size);
    if (bytes_.find('\0') != std::string_view::npos) return;
    constexpr auto kByteOrderMark = "\xEF\xBB\xBF"sv;
    text_ = bytes_.substr(bytes_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
    json_ = looks_like_json(text_);
    if (!json_) read_lines();
  }

  [[nodiscard]] const fs::path& path() const { return path_; }
  [[nodiscard]] bool folder() const { return folder_; }
  [[nodiscard]] std::optional<LogFormat> log() const { return log_; }
  [[nodiscard]] ByteSpan bytes() const { return as_bytes(bytes_); }
  [[nodiscard]] std::string_view text() const { return text_; }  ///< empty if the file is not text
  [[nodiscard]] bool json() const { return json_; }
  [[nodiscard]] bool begins(std::string_view magic) const { return bytes_.starts_with(magic); }
  [[nodiscard]] bool holds(const char* name) const {
    std::error_code ignored;
    return folder_ && fs::exists(path_ / name, ignored);
  }

  /// The text after a key, up to the end of the head. The key must be at the top level in YAML, but may be
  /// anywhere in JSON.
  [[nodiscard]] std::optional<std::string_view> value(std::string_view key) const {
    for (std::size_t at = text_.find(key); at != std::string_view::npos; at = text_.find(key, at + 1)) {
      const std::string_view rest = text_.substr(at + key.size());
      const char before = at == 0 ? '\n' : text_[at - 1];
      if (!json_ && before == '\n' && rest.starts_with(':')) return rest.substr(1);
      if (json_ && before == '"' && rest.starts_with('"') &&
          trimmed(rest.substr(1), " \t\r\n").starts_with(':'))
        return rest.substr(1);
    }
    return std::nullopt;
  }

  [[nodiscard]] bool has(std::string_view key) const { return value(key).has_value(); }
  [[nodiscard]] bool has_any(std::initializer_list<std::string_view> keys) const {
    return std::ranges::any_of(keys, [&](std::string_view key) { return has(key); });
  }
  /// Whether the value of the key `format` starts with this name.
  [[nodiscard]] bool has_format(std::string_view name) const {
    const auto format = value("format");
    return format && trimmed(format->substr(0, format->find('\n')), " \t\r\"'").starts_with(name);
  }
  /// Whether any indented line starts with the key.
  [[nodiscard]] bool has_below(std::string_view key) const {
    for (std::size_t at = text_.find(key); at != std::string_view::npos; at = text_.find(key, at + 1))
      if (at > 0 && text_[at - 1] == ' ' && text_.substr(at + key.size()).starts_with(':')) return true;
    return false;
  }

  /// The words of the first line that is neither blank nor a comment.
  [[nodiscard]] const std::vector<std::string_view>& words() const { return words_; }
  /// The column names of a table, taken from that line or, if it contains numbers, from the comment before
  /// it.
  [[nodiscard]] const std::vector<std::string_view>& columns() const { return columns_; }
  /// Whether that line contains commas, and the next line contains the same number of them.
  [[nodiscard]] bool even() const { return even_; }
  [[nodiscard]] bool has_column(std::initializer_list<std::string_view> names) const {
    return std::ranges::any_of(
        names, [&](std::string_view name) { return std::ranges::find(columns_, name) != columns_.end(); });
  }

 private:
  void read_lines() {
    std::string_view comment;
    for (std::string_view rest = text_; !rest.empty();) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      const std::string_view line = trimmed(rest.substr(0, end), " \t\r");
      rest.remove_prefix(std::min(end + 1, rest.size()));
      if (line.starts_with('#')) comment = line.substr(1);
      if (line.empty() || line.starts_with('#')) continue;
      words_ = parts_of(line, line.find(',') == std::string_view::npos ? " \t"sv : ","sv);
      std::erase(words_, std::string_view());
      const bool numbers = !words_.empty() && is_number(words_.front());
      columns_ = parts_of(numbers ? comment : line, ","sv);
      if (columns_.size() < 2 || !std::ranges::all_of(columns_, is_column)) columns_.clear();
      const std::string_view next = rest.substr(0, rest.find('\n'));
      const auto commas = std::ranges::count(line, ',');
      even_ = commas > 0 && std::ranges::count(next, ',') == commas;
      return;
    }
  }

  fs::path path_;
  bool folder_;
  std::string_view bytes_;
  std::optional<LogFormat> log_{};
  std::string_view text_{};
  bool json_ = false;
  std::vector<std::string_view> words_{};
  std::vector<std::string_view> columns_{};
  bool even_ = false;
};

/// Predicates that recognise each kind of file.
namespace is {

template <LogFormat format>
bool log(const FileHead& head) {
  return head.log() == format;
}

bool packed(const FileHead& head) { return packing_of(head.bytes()) != Packing::None; }
bool image(const FileHead& head) { return image_format_of(head.bytes()).has_value(); }
bool video(const FileHead& head) { return begins_as_video(head.bytes()); }
bool named_video(const FileHead& head) { return !head.folder() && has_video_ending(head.path().string()); }

bool map_folder(const FileHead& head) { return head.holds("map.yaml"); }
bool map(const FileHead& head) { return head.has_format("waymark-map-"); }
bool named_map(const FileHead& head) { return !head.folder() && head.path().filename() == "map.yaml"; }
bool route(const FileHead& head) { return head.has_format("waymark-route-"); }
bool calibration(const FileHead& head) { return head.has_format("waymark-calibration-"); }
bool robot(const FileHead& head) { return head.has("hull") && head.has("limits"); }
bool world(const FileHead& head) { return head.has("tag_family") && head.has("tags"); }
bool faults(const FileHead& head) { return head.has("faults"); }
bool topic_profile(const FileHead& head) { return head.has_any({"command_topic", "odometry_topic"}); }

bool detections(const FileHead& head) {
  return head.json() && head.has("image") && head.has_any({"detections", "error"});
}

bool bag_folder(const FileHead& head) {
  if (!head.folder()) return false;
  std::error_code error;
  for (fs::directory_iterator entry(head.path(), error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path name = entry->path().filename();
    if (name == "metadata.yaml" || name.extension() == ".db3" || name.extension() == ".mcap") return true;
  }
  return false;
}

bool camera(const FileHead& head) {
  if (head.json()) return head.has("cameraIntrinsics");
  return head.has_any({"camera_matrix", "cameraMatrix", "image_width", "distortion_coefficients",
                       "projection_matrix"}) ||
         head.has_below("camera_model") || (head.has_below("intrinsics") && head.has_below("resolution"));
}

bool fmap(const FileHead& head) { return looks_like_fmap(head.text()); }
bool wpilib_layout(const FileHead& head) {
  return looks_like_wpilib_layout(head.text()) && (!head.json() || head.has("ID"));
}
/// A map with `tag_N:` under `tags:`.
bool academy_map(const FileHead& head) {
  const auto tags = head.json() ? std::nullopt : head.value("tags");
  const std::string_view below = trimmed(tags.value_or(""), " \t\r\n");
  const std::string_view key = below.substr(0, below.find(':'));
  return key.size() < below.size() && is_column(key) && key.back() >= '0' && key.back() <= '9';
}
bool tag_transforms(const FileHead& head) { return head.has("transforms"); }
bool tagslam_bodies(const FileHead& head) { return head.has("bodies"); }
bool tagslam_config(const FileHead& head) { return head.json() && head.has("bodies") && head.has("cameras"); }
bool tagslam_file(const FileHead& head) {
  return head.has("tagslam_parameters") || (head.has("cam0") && head.has_below("pose"));
}
bool tagslam_folder(const FileHead& head) {
  return head.holds("tagslam.yaml") ||
         (head.holds("config.json") && kind_of(head.path() / "config.json") == FileKind::TagslamFile);
}

bool sdf_world(const FileHead& head) { return head.text().find("<sdf") != std::string_view::npos; }
bool document(const FileHead& head) {
  const bool xml = head.begins("<?xml") && head.text().find("<svg") != std::string_view::npos;
  return xml || head.begins("<svg") || head.begins("%PDF") || head.begins("<!DOCTYPE html") ||
         head.begins("<html");
}

/// Rows of eight numbers, optionally separated by commas.
bool trajectory(const FileHead& head) {
  return head.words().size() == 8 && std::ranges::all_of(head.words(), is_number);
}
bool csv_log(const FileHead& head) { return head.has_column({"t_ns", "t_s"}); }
bool true_corners(const FileHead& head) {
  return head.has_column({"image"}) && head.has_column({"x0"}) && head.has_column({"y3"});
}
bool path(const FileHead& head) { return head.has_column({"x", "x_m"}) && head.has_column({"y", "y_m"}); }
bool points(const FileHead& head) { return path(head) && head.has_column({"id", "landmark", "tag"}); }
/// A header followed by rows, or rows of numbers without a header.
bool table(const FileHead& head) {
  return head.even() && (!head.columns().empty() || std::ranges::all_of(head.words(), is_number));
}

}  // namespace is

using Use = FileUse;

template <class... Uses>
constexpr std::uint32_t uses_of(Uses... uses) {
  return ((std::uint32_t{1} << static_cast<unsigned>(uses)) | ... | 0U);
}

constexpr std::uint32_t kOfTable =
    uses_of(Use::Recording, Use::Video, Use::Estimate, Use::Reference, Use::Line);
constexpr std::uint32_t kOfLog = kOfTable | uses_of(Use::AnyMap);
constexpr std::uint32_t kOfMap = uses_of(Use::MapFolder, Use::OwnMap, Use::Map, Use::AnyMap, Use::Page);
constexpr std::uint32_t kOfOthersMap = uses_of(Use::Map, Use::AnyMap);

/// A kind of file.
struct KindRow {
  FileKind kind;
  std::string_view name;             ///< name as in "this is NAME"
  bool (*is)(const FileHead& head);  ///< recognises this kind
  std::uint32_t uses;                ///< what files of this kind can be used for
  std::string_view verbs{};          ///< the verbs that accept it, where {0} stands for the path
};

constexpr std::string_view kMapLog = "`waymark map {0}` maps it, `waymark info {0}` lists its contents.";
constexpr std::string_view kConvertMap = "`waymark map convert {0} map.yaml` converts it to map.yaml.";

/// The table of kinds, in the order in which they are tried: first by bytes, then by keys, and finally as
/// tables, because many texts begin like a table. A kind may have several rows; all members except `is` are
/// taken from the first one.
constexpr std::array kFileKinds = {
    KindRow{FileKind::MapFolder, "a map folder", is::map_folder, kOfMap,
            "`waymark replay {0}` drives its route, `waymark view {0}` shows it."},
    KindRow{FileKind::TagslamFolder, "a TagSLAM folder", is::tagslam_folder, uses_of(Use::TagslamFolder),
            "`waymark map scene RECORDING tagslam={0}` maps a recording with it."},
    KindRow{FileKind::BagFolder, "a folder of recordings", is::bag_folder,
            kOfLog | uses_of(Use::OwnMap, Use::Map), kMapLog},  // a subfolder may contain a map

    KindRow{FileKind::Mcap, "a recording (MCAP)", is::log<LogFormat::Mcap>, kOfLog | uses_of(Use::Page),
            kMapLog},
    KindRow{FileKind::Rosbag2, "a recording (rosbag2)", is::log<LogFormat::Rosbag2>, kOfLog, kMapLog},
    KindRow{FileKind::Ros1Bag, "a recording (ROS 1 bag)", is::log<LogFormat::Ros1Bag>, kOfLog, kMapLog},
    KindRow{FileKind::Packed, "a compressed file (bzip2, gzip or zstd)", is::packed, kOfLog,
            "Unpack it first: only recordings are read from compressed files."},
    KindRow{FileKind::Image, "an image", is::image, uses_of(Use::Image),
            "`waymark detect {0}` detects its tags, `waymark calibrate camera` takes images of a board."},
    KindRow{FileKind::Video, "a video", is::video, uses_of(Use::Video),
            "`waymark map {0}` maps its tags, `waymark detect {0}` detects them."},
    KindRow{FileKind::LcmLog, "a recording (LCM event log)", is::log<LogFormat::Lcm>, kOfLog, kMapLog},
    KindRow{FileKind::Video, "a video", is::named_video, uses_of(Use::Video)},

    KindRow{FileKind::Map, "a map", is::map, kOfMap,
            "`waymark view {0}` shows it; other verbs take it as `map`."},
    KindRow{FileKind::Route, "a route", is::route, uses_of(Use::Reference, Use::Page),
            "`waymark replay` takes its map folder."},
    KindRow{FileKind::Calibration, "a calibration", is::calibration, uses_of(Use::Calibration, Use::Camera),
            "Verbs take it as `calibration` or, if it contains a camera, as `camera`."},
    KindRow{FileKind::Detections, "the output of `waymark detect`", is::detections, uses_of(Use::Detections),
            "`waymark evaluate detections` and `waymark calibrate camera` take it as `detections`."},
    KindRow{FileKind::Fmap, "a Limelight field map", is::fmap, kOfOthersMap, kConvertMap},
    KindRow{FileKind::TagslamFile, "a TagSLAM file", is::tagslam_config, 0,
            "`waymark map scene` takes its folder as `tagslam`."},
    KindRow{FileKind::WpilibLayout, "a WPILib field layout", is::wpilib_layout, kOfOthersMap, kConvertMap},
    KindRow{FileKind::Camera, "a camera calibration", is::camera, uses_of(Use::Camera),
            "Verbs take it as `camera`."},
    KindRow{FileKind::Robot, "a robot file", is::robot, uses_of(Use::Robot, Use::Camera, Use::Page),
            "`waymark robots {0}` checks it; other verbs take it as `robot`."},
    KindRow{FileKind::World, "a simulated world", is::world, uses_of(Use::World, Use::Page),
            "`waymark world check {0}` checks it; other verbs take it as `world`."},
    KindRow{FileKind::Faults, "a fault script", is::faults, uses_of(Use::Faults),
            "Verbs that simulate a robot take it as `faults`."},
    KindRow{FileKind::TopicProfile, "a topic profile", is::topic_profile, 0,
            "Verbs take it as `robot=ros2:{0}` or `robot=gazebo:{0}`."},
    KindRow{FileKind::TagslamBodies, "a TagSLAM file (bodies)", is::tagslam_bodies, uses_of(Use::AnyMap),
            kConvertMap},
    KindRow{FileKind::TagslamFile, "a TagSLAM file", is::tagslam_file, 0},
    KindRow{FileKind::TagTransforms, "a list of transforms (tf)", is::tag_transforms, uses_of(Use::AnyMap),
            kConvertMap},
    KindRow{FileKind::AcademyMap, "a Robotics Academy map", is::academy_map, kOfOthersMap, kConvertMap},
    KindRow{FileKind::SdfWorld, "a Gazebo world (SDF)", is::sdf_world, uses_of(Use::SdfWorld),
            "`waymark world import {0} output=world.yaml` converts it to a world."},
    KindRow{FileKind::Document, "a figure or a page", is::document, 0, "No verb reads it."},

    KindRow{FileKind::TumTrajectory, "a trajectory (TUM)", is::trajectory,
            uses_of(Use::Estimate, Use::Reference), "`waymark evaluate` compares it with another one."},
    KindRow{FileKind::CsvLog, "a table with a time column", is::csv_log, kOfTable,
            "`waymark info {0}` lists its contents, `waymark convert {0} out.mcap` makes it a recording."},
    KindRow{FileKind::TrueCorners, "a table of true corners", is::true_corners, uses_of(Use::TrueCorners),
            "`waymark evaluate detections` takes it as `truth`."},
    KindRow{FileKind::Points, "a table of points", is::points,
            kOfOthersMap | uses_of(Use::Reference, Use::Line), "`waymark localize` takes it as `map`."},
    KindRow{FileKind::Path, "a path (table of x and y)", is::path, uses_of(Use::Reference, Use::Line),
            "`waymark world new path={0}` builds a world along it, `waymark evaluate` takes it as REF."},
    KindRow{FileKind::Table, "a table", is::table, kOfTable | kOfOthersMap | uses_of(Use::TrueCorners),
            "docs/formats/importing.md lists the columns that are read."},

    KindRow{FileKind::Map, "a map", is::named_map, kOfMap},
};

const KindRow* row_of_kind(FileKind kind) {
  const auto row = std::ranges::find(kFileKinds, kind, &KindRow::kind);
  return row == kFileKinds.end() ? nullptr : &*row;
}

/// The name of the expected use, as in "not WANTED".
constexpr std::string_view wanted_name(FileUse use) {
  switch (use) {
    case Use::Recording:
      return "a recording";
    case Use::Video:
      return "a video or a recording";
    case Use::Image:
      return "an image";
    case Use::Estimate:
      return "a trajectory";
    case Use::Reference:
      return "a trajectory, a route or a path";
    case Use::Line:
      return "a line to drive";
    case Use::MapFolder:
      return "a map folder";
    case Use::OwnMap:
      return "a map.yaml";
    case Use::Map:
    case Use::AnyMap:
      return "a tag map";
    case Use::Camera:
      return "a camera calibration";
    case Use::Calibration:
      return "a calibration.yaml";
    case Use::Robot:
      return "a robot file";
    case Use::World:
      return "a simulated world";
    case Use::SdfWorld:
      return "a Gazebo world (SDF)";
    case Use::Faults:
      return "a fault script";
    case Use::Detections:
      return "the output of `waymark detect`";
    case Use::TrueCorners:
      return "a table of true corners";
    case Use::Page:
      return "a recording, a map, a route or a world";
    case Use::TagslamFolder:
      return "a TagSLAM folder";
  }
  return {};
}

std::string verbs_of(const KindRow& row, const fs::path& path) {
  return fmt::format(fmt::runtime(row.verbs), shell_word(path.string()));
}

FileKind kind_of_head(const FileHead& head) {
  for (const KindRow& row : kFileKinds)
    if (row.is(head)) return row.kind;
  return FileKind::Unknown;
}

}  // namespace

FileKind kind_of(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) return kind_of_head({path, true, {}, 0});
  if (fs::exists(status) && !fs::is_regular_file(status)) return FileKind::Unknown;
  const auto source = open_file(path);
  const std::uint64_t size = source ? (*source)->size().value_or(0) : 0;
  Bytes bytes(static_cast<std::size_t>(std::min<std::uint64_t>(size, kFileHeadBytes)));
  if (!bytes.empty() && !(*source)->read(0, bytes)) bytes.clear();
  return kind_of_head({path, false, as_text(bytes), size});
}

FileKind kind_of_content(std::string_view content, const fs::path& path) {
  return kind_of_head({path, false, content.substr(0, kFileHeadBytes), content.size()});
}

bool is_recording(FileKind kind) {
  using enum FileKind;
  return kind == Mcap || kind == Rosbag2 || kind == BagFolder || kind == Ros1Bag || kind == LcmLog ||
         kind == Packed;
}

bool is_table_kind(FileKind kind) {
  using enum FileKind;
  return kind == CsvLog || kind == TrueCorners || kind == Points || kind == Path || kind == Table;
}

std::optional<Error> wrong_kind(const fs::path& path, FileUse wanted) {
  std::error_code ignored;
  const KindRow* row = fs::exists(path, ignored) ? row_of_kind(kind_of(path)) : nullptr;
  if (row == nullptr || (row->uses & uses_of(wanted)) != 0) return std::nullopt;
  return Error{ErrorCode::InvalidArgument,
               fmt::format("this is {}, not {}", row->name, wanted_name(wanted)),
               {.source = path.string()},
               verbs_of(*row, path)};
}

std::string described_kind(const fs::path& path) {
  std::error_code ignored;
  const KindRow* row = fs::exists(path, ignored) ? row_of_kind(kind_of(path)) : nullptr;
  return row == nullptr ? "" : fmt::format("{} is {}. {}", path.string(), row->name, verbs_of(*row, path));
}

Result<std::unique_ptr<MessageLog>> open_recording(const fs::path& path, const JobControl& control) {
  return or_wrong_kind(open_log(path, control.log_options()), path, FileUse::Recording);
}

Result<std::unique_ptr<MessageLog>> open_recordings(const std::vector<std::string>& paths,
                                                    const JobControl& control, const LogOptions& options) {
  Result<std::unique_ptr<MessageLog>> log = open_logs(paths, control.log_options(options));
  for (const std::string& path : paths) log = or_wrong_kind(std::move(log), path, FileUse::Recording);
  return log;
}

}  // namespace waymark
