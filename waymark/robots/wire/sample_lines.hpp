#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/process/drop_words.hpp"
#include "waymark/robots/process/robot_clock.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {

/// Pictures on their way to another process, as files in memory: a folder of ten names in turn, in /dev/shm
/// where it is there. Each is whole when it has its name. The folder goes with this.
class PictureRing {
 public:
  static Result<PictureRing> make();
  ~PictureRing();
  PictureRing(PictureRing&& other) noexcept : folder_(std::exchange(other.folder_, {})), next_(other.next_) {}
  PictureRing(const PictureRing&) = delete;
  PictureRing& operator=(const PictureRing&) = delete;
  PictureRing& operator=(PictureRing&&) = delete;

  /// The path of the file with these bytes; it is overwritten ten pictures later.
  Result<std::string> put(std::span<const std::uint8_t> bytes);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  explicit PictureRing(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
  unsigned next_ = 0;
};

/// Puts a picture, the bytes of a JPEG, PNG or PNM file, where the other side finds it: the path of a file.
using PutPicture = std::function<Result<std::string>(std::span<const std::uint8_t>)>;
/// Files in memory (PictureRing); empty where none can be made: pictures then stand in the lines themselves.
[[nodiscard]] PutPicture pictures_in_memory();

/// The samples of a robot on a network as lines of a robot process (docs/formats/robot-process.md). What the
/// other end would refuse, and what has a stamp that misleads, is dropped, counted, and named in words. Pure
/// but for `put_picture`.
class SampleLines {
 public:
  /// `network` is what errors call the robot's network.
  SampleLines(std::string network, const std::string& robot_name, PutPicture put_picture);

  /// The line of a sample that came on this topic. `arrived`, `leads`: as StampGate::pass() has them.
  [[nodiscard]] Result<std::string> line_of(Sample sample, const std::string& topic, Duration arrived,
                                            bool leads);
  /// The line of a picture that is encoded already.
  [[nodiscard]] Result<std::string> line_of(SensorTime stamp, const std::vector<std::uint8_t>& picture,
                                            const std::string& topic, Duration arrived);

  /// Counts a message that was dropped, and says so: the first ones, then each time their number doubled.
  void drop(const std::string& topic, const Error& error);
  void say_once(std::string words);
  /// What people should know, since the last call: as lines, too.
  [[nodiscard]] std::vector<std::string> take_words();
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  /// Whether the topic that leads spoke.
  [[nodiscard]] bool speaks() const { return gate_.offset().has_value(); }
  /// StampGate::offset().
  [[nodiscard]] std::optional<Duration> offset() const { return gate_.offset(); }

 private:
  [[nodiscard]] Result<std::string> picture_line(SensorTime stamp,
                                                 const std::vector<std::uint8_t>& picture) const;

  PutPicture put_picture_;
  StampGate gate_{};
  RobotMessageReader check_;  ///< nothing leaves that the other end would refuse
  std::int64_t checked_ = 0;
  DropWords drops_{};
  std::uint64_t dropped_ = 0;
  std::map<std::string, bool> said_{};
  std::vector<std::string> words_{};
};

/// What a published calibration has that the robot's file has not, in words; empty where they agree within 1
/// % of the focal length.
[[nodiscard]] std::string camera_difference(const CameraModel& published, const RobotDescription& robot);

}  // namespace waymark
