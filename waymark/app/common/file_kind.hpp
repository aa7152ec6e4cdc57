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

/// Determines the kind of a file. The table in file_kind.cpp specifies how each kind is recognised, its name,
/// its uses, and the verbs that accept it. Every verb whose behaviour depends on the kind of a file uses this
/// table.
namespace waymark {

enum class FileKind : std::uint8_t {
  Unknown,
  Mcap,
  Rosbag2,    ///< .db3
  BagFolder,  ///< a folder of .db3 or .mcap files
  Ros1Bag,
  LcmLog,
  Packed,  ///< compressed with bzip2, gzip or zstd; can only be read as a recording
  Video,
  Image,
  MapFolder,
  Map,            ///< map.yaml
  AcademyMap,     ///< the Robotics Academy's apriltags_poses.yaml
  WpilibLayout,   ///< JSON or CSV
  Fmap,           ///< Limelight field map
  TagslamBodies,  ///< `bodies` from TagSLAM, or its poses.yaml
  TagslamFile,    ///< any other file in a TagSLAM folder
  TagslamFolder,
  TagTransforms,  ///< transforms from tf as YAML
  Route,
  Calibration,  ///< calibration.yaml
  Camera,       ///< camera_info from ROS, camchain from kalibr, or a calibration from PhotonVision or OpenCV
  Robot,
  World,
  SdfWorld,
  Faults,
  TopicProfile,  ///< topics of a robot that uses ROS 2 or Gazebo
  Detections,    ///< output of `waymark detect --json`
  Document,      ///< SVG, PDF or HTML
  TumTrajectory,
  CsvLog,       ///< a table with a time column
  TrueCorners,  ///< a table with the columns image, id, x0 …
  Points,       ///< a table with the columns id, x, y
  Path,         ///< a table with the columns x, y
  Table,        ///< any other table
};

/// What a file is used for. The comments name the function that reads it.
enum class FileUse : std::uint8_t {
  Recording,      ///< open_log()
  Video,          ///< VideoReader, or open_log() for the images of a recording
  Image,          ///< read_image()
  Estimate,       ///< read_estimate()
  Reference,      ///< read_reference()
  Line,           ///< read_line()
  MapFolder,      ///< a folder with map.yaml, route.yaml, …
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

/// Determines the kind of a file or folder from at most the first 64 KiB of its content. Videos and map.yaml
/// are also recognised by their names, so that their readers can report a missing or damaged file. Returns
/// Unknown if the file does not exist, does not match any kind, or is a pipe or device, which are not read.
[[nodiscard]] FileKind kind_of(const std::filesystem::path& path);
/// The same for content in memory, such as data from a pipe; `path` is its name.
[[nodiscard]] FileKind kind_of_content(std::string_view content, const std::filesystem::path& path);

/// Whether only open_log() reads files of this kind. False for CsvLog, because a table may contain anything.
[[nodiscard]] bool is_recording(FileKind kind);
/// Whether files of this kind are tables with a header.
[[nodiscard]] bool is_table_kind(FileKind kind);

/// Describes the kind of `path` and the verbs that accept it, for example "lap.mcap: this is a recording
/// (MCAP), not a tag map. `waymark map lap.mcap` maps it." Returns `nullopt` if its kind is unknown or suits
/// this use.
[[nodiscard]] std::optional<Error> wrong_kind(const std::filesystem::path& path, FileUse wanted);

/// Describes the kind of a file and the verbs that accept it in one sentence; empty if the kind is unknown.
[[nodiscard]] std::string described_kind(const std::filesystem::path& path);

/// Passes on the result of reading `path`. If reading failed because the file is of the wrong kind, returns
/// the error from wrong_kind() with the code of the original error.
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

/// Call open_log() and open_logs() with the limits of a job, and report files of the wrong kind as
/// wrong_kind() does.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_recording(const std::filesystem::path& path,
                                                                 const JobControl& control = {});
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_recordings(const std::vector<std::string>& paths,
                                                                  const JobControl& control,
                                                                  const LogOptions& options = {});

}  // namespace waymark
