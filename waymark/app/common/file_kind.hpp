#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/recording/message_log.hpp"

/// The kind of a file. The table in file_kind.cpp has one row per kind: how its content is recognised, its
/// name, its uses, and the verbs that accept it. Every verb that depends on the kind of a file uses this
/// table.
namespace waymark {

enum class FileKind : std::uint8_t {
  Unknown,
  Mcap,
  Rosbag2,    ///< .db3
  BagFolder,  ///< a folder of .db3 or .mcap files
  Ros1Bag,
  LcmLog,
  Packed,  ///< with bzip2, gzip or zstd: read as a recording only
  Video,
  Image,
  MapFolder,
  Map,            ///< map.yaml
  AcademyMap,     ///< the Robotics Academy's apriltags_poses.yaml
  WpilibLayout,   ///< JSON or CSV
  Fmap,           ///< Limelight field map
  TagslamBodies,  ///< `bodies` of TagSLAM, also its poses.yaml
  TagslamFile,    ///< another file of a TagSLAM folder
  TagslamFolder,
  TagTransforms,  ///< transforms of tf as YAML
  Route,
  Calibration,  ///< calibration.yaml
  Camera,       ///< camera_info of ROS, camchain of kalibr, calibration of PhotonVision or OpenCV
  Robot,
  World,
  SdfWorld,
  Faults,
  TopicProfile,  ///< topics of a robot with ROS 2 or in Gazebo
  Detections,    ///< output of `waymark detect --json`
  Document,      ///< SVG, PDF or HTML
  Trajectory,    ///< TUM
  CsvLog,        ///< a table with a time column
  TrueCorners,   ///< a table with the columns image, id, x0 …
  Points,        ///< a table with the columns id, x, y
  Path,          ///< a table with the columns x, y
  Table,         ///< any other table
};

/// The use of a file, with its reader.
enum class FileUse : std::uint8_t {
  Recording,      ///< open_log()
  Video,          ///< VideoReader, or open_log() for the images of a recording
  Image,          ///< read_image()
  Estimate,       ///< read_estimate()
  Reference,      ///< read_reference()
  Line,           ///< read_line()
  MapFolder,      ///< its map.yaml, route.yaml, …
  OwnMap,         ///< read_map()
  Map,            ///< read_landmarks()
  AnyMap,         ///< read_any_map(), read_map_transforms()
  Camera,         ///< read_camera()
  Calibration,    ///< read_calibration()
  Robot,          ///< read_robot()
  World,          ///< read_world()
  SdfWorld,       ///< read_sdf()
  Faults,         ///< read_faults()
  Detections,     ///< parse_reports()
  TrueCorners,    ///< parse_truth()
  Page,           ///< input of `waymark view`
  TagslamFolder,  ///< read_tagslam_folder()
};

/// The kind of a file or folder, from at most the first 64 KiB of its content. Videos and map.yaml are also
/// recognised by their names, so that their readers report a file that is missing or damaged. Unknown if the
/// file does not exist, has none of the kinds, or is a pipe or device, which is not read.
[[nodiscard]] FileKind kind_of(const std::filesystem::path& path);
/// The same for content in memory, such as that of a pipe; `path` is its name.
[[nodiscard]] FileKind kind_of_content(std::string_view content, const std::filesystem::path& path);

/// Whether open_log() is the only reader of this kind. False for CsvLog, because a table may contain
/// anything.
[[nodiscard]] bool is_recording(FileKind kind);
/// Whether it is a table with a header.
[[nodiscard]] bool is_table_kind(FileKind kind);

/// The kind of `path` and the verbs that accept it, such as "lap.mcap: this is a recording (MCAP), not a tag
/// map. `waymark map lap.mcap` maps it." Nothing if its kind is unknown or has this use.
[[nodiscard]] std::optional<Error> wrong_kind(const std::filesystem::path& path, FileUse wanted);

/// The kind and the verbs of a known file in one sentence; empty if its kind is unknown.
[[nodiscard]] std::string described_kind(const std::filesystem::path& path);

/// The result of a reader of `path`. If it failed on a file of the wrong kind, the error of wrong_kind() with
/// the code of the reader.
template <class Value>
[[nodiscard]] Result<Value> or_wrong_kind(Result<Value> read, const std::filesystem::path& path,
                                          FileUse wanted) {
  if (read) return read;
  if (std::optional<Error> wrong = wrong_kind(path, wanted)) {
    wrong->code = read.error().code;
    return tl::unexpected(*std::move(wrong));
  }
  return read;
}

/// open_log() and open_logs() with the limits of a job and the error of wrong_kind().
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_recording(const std::filesystem::path& path,
                                                                 const JobControl& control = {});
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_recordings(const std::vector<std::string>& paths,
                                                                  const JobControl& control,
                                                                  const LogOptions& options = {});

}  // namespace waymark
