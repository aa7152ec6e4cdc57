#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/process/drop_reports.hpp"
#include "waymark/robots/process/robot_clock.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {

/// Passes images to another process as files in memory: a ring of ten files in a folder in /dev/shm, or in
/// the temporary folder if /dev/shm does not exist. Complete files are renamed into place. The destructor
/// removes the folder.
class ImageRing {
 public:
  static Result<ImageRing> make();
  ~ImageRing();
  ImageRing(ImageRing&& other) noexcept : folder_(std::exchange(other.folder_, {})), next_(other.next_) {}
  ImageRing(const ImageRing&) = delete;
  ImageRing& operator=(const ImageRing&) = delete;
  ImageRing& operator=(ImageRing&&) = delete;

  /// Writes the bytes to a file and returns its path. The file is overwritten ten images later.
  Result<std::string> put(std::span<const std::uint8_t> bytes);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  explicit ImageRing(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
  unsigned next_ = 0;
};

/// Writes an image, given as the bytes of a JPEG, PNG or PNM file, to a file for the other process and
/// returns its path.
using PutImage = std::function<Result<std::string>(std::span<const std::uint8_t>)>;
/// Writes to an ImageRing. Empty if one cannot be created, so that lines contain the images as base64.
[[nodiscard]] PutImage images_in_memory();

/// Converts samples from a robot on a network to lines of a robot process (docs/formats/robot-process.md).
/// Samples that the reader would reject, and those with misleading timestamps, are returned as errors for
/// drop(), which counts and reports them. Pure except for `put_image`.
class SampleLines {
 public:
  /// `network` is the name of the robot's network in errors.
  SampleLines(std::string network, const std::string& robot_name, PutImage put_image);

  /// The line for a sample received on this topic. See StampGate::pass() for `arrived` and `leads`.
  [[nodiscard]] Result<std::string> line_of(Sample sample, const std::string& topic, Duration arrived,
                                            bool leads);
  /// The line for an encoded image.
  [[nodiscard]] Result<std::string> line_of(SensorTime stamp, const std::vector<std::uint8_t>& image,
                                            const std::string& topic, Duration arrived);

  /// Counts a dropped message and reports it using DropReports.
  void drop(const std::string& topic, const Error& error);
  void report_once(std::string text);
  /// The reports for the user since the last call, as log lines.
  [[nodiscard]] std::vector<std::string> take_reports();
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  /// Whether a message on the leading topic has been accepted.
  [[nodiscard]] bool speaks() const { return gate_.offset().has_value(); }
  /// StampGate::offset().
  [[nodiscard]] std::optional<Duration> offset() const { return gate_.offset(); }

 private:
  [[nodiscard]] Result<std::string> image_line(SensorTime stamp,
                                               const std::vector<std::uint8_t>& image) const;

  PutImage put_image_;
  StampGate gate_{};
  RobotMessageReader check_;  ///< rejects lines that the reader in the other process would reject
  std::int64_t checked_ = 0;
  DropReports drops_{};
  std::uint64_t dropped_ = 0;
  std::set<std::string> reported_{};
  std::vector<std::string> pending_{};
};

/// A message if a published calibration differs from that in the robot file. Empty if the image sizes are
/// equal and the focal lengths and principal points agree to within 1 % of the focal length.
[[nodiscard]] std::string camera_difference(const CameraModel& published, const RobotDescription& robot);

}  // namespace waymark
