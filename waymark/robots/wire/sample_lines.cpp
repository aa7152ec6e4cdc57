#include "waymark/robots/wire/sample_lines.hpp"

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
constexpr unsigned kNames = 10;
constexpr std::string_view kFolder = "waymark-images-";

/// Removes the folders of processes that were killed and could not remove them themselves.
void remove_abandoned(const fs::path& where) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(where, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kFolder)) continue;
    pid_t process = 0;
    const char* const end = name.data() + name.size();
    const auto [rest, error] = std::from_chars(name.data() + kFolder.size(), end, process);
    const bool of_process = error == std::errc{} && rest != end && *rest == '-' && process > 0;
    if (of_process && ::kill(process, 0) != 0 && errno == ESRCH) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

Result<ImageRing> ImageRing::make() {
  std::error_code error;
  const fs::path memory = "/dev/shm";
  const fs::path where = fs::is_directory(memory, error) ? memory : fs::temp_directory_path(error);
  remove_abandoned(where);
  std::string name = (where / fmt::format("{}{}-XXXXXX", kFolder, ::getpid())).string();
  if (mkdtemp(name.data()) == nullptr)
    return fail(ErrorCode::Unwritable, "cannot create a folder for images", {.source = where.string()});
  return ImageRing(fs::path(name));
}

ImageRing::~ImageRing() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

Result<std::string> ImageRing::put(std::span<const std::uint8_t> bytes) {
  const fs::path unfinished = folder_ / "next";
  const fs::path path = folder_ / fmt::format("{}.image", next_++ % kNames);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(unfinished.c_str(), "wb"),
                                                             &std::fclose);
  const bool written = file != nullptr &&
                       std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                       std::fflush(file.get()) == 0;
  std::error_code error;
  if (written) fs::rename(unfinished, path, error);
  if (!written || error)
    return fail(ErrorCode::Unwritable, "cannot write an image", {.source = path.string()},
                "Check whether the memory is full.");
  return path.string();
}

namespace {

/// Converts a message with several lines to one line: "the transforms are:\n  odom\n    base" becomes "the
/// transforms are: odom, base".
std::string one_line(const std::string& text) {
  std::string line;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\n') {
      line += text[i];
      continue;
    }
    line += line.ends_with(':') ? " " : ", ";
    while (i + 1 < text.size() && text[i + 1] == ' ') ++i;
  }
  return line;
}

}  // namespace

PutImage images_in_memory() {
  auto made = ImageRing::make();
  if (!made) return {};
  const auto ring = std::make_shared<ImageRing>(std::move(*made));
  return [ring](std::span<const std::uint8_t> bytes) { return ring->put(bytes); };
}

SampleLines::SampleLines(std::string network, const std::string& robot_name, PutImage put_image)
    : put_image_(std::move(put_image)), check_(std::move(network)) {
  (void)check_.read({.text = to_line(RobotHello{.name = robot_name})});
}

Result<std::string> SampleLines::line_of(Sample sample, const std::string& topic, Duration arrived,
                                         bool leads) {
  if (Status status = gate_.pass(topic, stamp_of(sample), arrived, leads); !status)
    return tl::unexpected(status.error());
  if (auto* frame = std::get_if<CameraFrame>(&sample)) {
    frame->camera = "cam";
    const auto image = encode_pnm(frame->image);
    if (!image) return tl::unexpected(image.error());
    return image_line(frame->stamp, *image);
  }
  if (auto* tags = std::get_if<TagFrame>(&sample)) tags->camera = "cam";
  std::string line = to_line(sample);
  const auto checked = check_.read({.number = ++checked_, .text = line});
  if (!checked) return tl::unexpected(checked.error());
  return line;
}

Result<std::string> SampleLines::line_of(SensorTime stamp, const std::vector<std::uint8_t>& image,
                                         const std::string& topic, Duration arrived) {
  if (Status status = gate_.pass(topic, stamp, arrived, false); !status)
    return tl::unexpected(status.error());
  return image_line(stamp, image);
}

/// Passes the path of a file if possible, which avoids encoding the image in base64 and JSON.
Result<std::string> SampleLines::image_line(SensorTime stamp, const std::vector<std::uint8_t>& image) const {
  if (!put_image_) return to_line(CameraFrame{.stamp = stamp}, image);
  const auto path = put_image_(image);
  if (!path) return tl::unexpected(path.error());
  return fmt::format("{{\"type\":\"image\",\"stamp_ns\":{},\"path\":\"{}\"}}\n",
                     stamp.time_since_epoch().count(), *path);
}

void SampleLines::drop(const std::string& topic, const Error& error) {
  ++dropped_;
  std::string report = drops_.add(topic, error.message);
  if (!report.empty()) pending_.push_back(std::move(report));
}

void SampleLines::report_once(std::string text) {
  if (reported_.insert(text).second) pending_.push_back(std::move(text));
}

std::vector<std::string> SampleLines::take_reports() {
  std::vector<std::string> lines;
  for (const std::string& text : std::exchange(pending_, {}))
    lines.push_back(to_line(RobotLog{one_line(text)}));
  return lines;
}

std::string camera_difference(const CameraModel& published, const RobotDescription& robot) {
  constexpr double kMaxRelativeDifference = 0.01;
  const CameraModel& expected = robot.camera;
  const auto principal = [](const CameraModel& model) {
    return std::visit([](const auto& m) { return Eigen::Vector4d(m.fx, m.fy, m.cx, m.cy); },
                      model.projection());
  };
  const bool same_size =
      published.width_px() == expected.width_px() && published.height_px() == expected.height_px();
  const Eigen::Vector4d theirs = principal(published);
  const Eigen::Vector4d ours = principal(expected);
  if (same_size && (theirs - ours).cwiseAbs().maxCoeff() <= kMaxRelativeDifference * ours[0]) return {};
  return fmt::format(
      "camera_info: {} x {} px, f {:.1f} px, c ({:.1f}, {:.1f}) px; robot file {}, which is used: {} x {} "
      "px, f {:.1f} px, c ({:.1f}, {:.1f}) px",
      published.width_px(), published.height_px(), theirs[0], theirs[2], theirs[3], robot.model.name,
      expected.width_px(), expected.height_px(), ours[0], ours[2], ours[3]);
}

}  // namespace waymark
