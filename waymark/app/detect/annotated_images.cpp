#include "waymark/app/detect/annotated_images.hpp"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/media/video_reader.hpp"

namespace waymark {
namespace {

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "a__photo.jpg" for "a/photo.jpg". Any ".." and a leading "/" are dropped.
std::string flattened(const std::string& path) {
  std::string name;
  for (const auto& part : std::filesystem::path(path).lexically_normal().relative_path()) {
    if (part == ".." || part == ".") continue;
    name += (name.empty() ? "" : "__") + part.string();
  }
  return name;
}

}  // namespace

std::vector<std::string> annotation_names(const std::vector<std::string>& images) {
  std::map<std::string, int> uses;
  for (const std::string& image : images) ++uses[lower(std::filesystem::path(image).stem().string())];
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const std::string& image : images) {
    const std::string stem = std::filesystem::path(image).stem().string();
    const std::string base = uses[lower(stem)] == 1 ? stem : flattened(image);
    std::string name = base + ".png";
    for (int number = 2; !taken.insert(lower(name)).second; ++number)
      name = fmt::format("{}-{}.png", base, number);
    names.push_back(name);
  }
  return names;
}

Result<AnnotatedVideo> AnnotatedVideo::create(const std::string& path, const std::vector<Input>& inputs) {
  AnnotatedVideo video;
  video.path_ = path;
  bool has_rate = false;
  for (const Input& input : inputs) {
    std::error_code ignored;
    if (std::filesystem::equivalent(input.path, path, ignored))
      return fail(ErrorCode::InvalidArgument, "the output is also an input video", {.source = path},
                  "Set `annotate` to another name.");
    if (has_rate || input.error || kind_of(input.path) != FileKind::Video) continue;
    const Result<VideoReader> reader = VideoReader::open(input.path);
    if (!reader) continue;  // the error is reported when the video is read
    video.options_.rate_hz = reader->info().mean_rate_hz.value_or(video.options_.rate_hz);
    video.options_.rotation_deg = reader->info().rotation_deg;
    has_rate = true;
  }
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored))
    return fail(ErrorCode::Unwritable, "the file already exists", {.source = path},
                "Set `annotate` to another name.");
  return video;
}

Status AnnotatedVideo::add(const ColorImage& image, std::optional<SensorTime> stamp) {
  if (!writer_) {
    Result<VideoWriter> made = VideoWriter::create(path_, image.width(), image.height(), options_);
    if (!made) return tl::unexpected(made.error());
    writer_ = std::move(*made);
  }
  const Duration step(std::llround(1e9 / options_.rate_hz));
  SensorTime shown = stamp ? *stamp + shift_ : last_ ? *last_ + step : SensorTime();
  if (last_ && shown <= *last_) {
    shift_ += *last_ + step - shown;
    shown = *last_ + step;
  }
  last_ = shown;
  return writer_->add(image, shown);
}

Status AnnotatedVideo::close() { return writer_ ? writer_->close() : Status(); }

}  // namespace waymark
