#include "waymark/codecs/image_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/base/error.hpp"
#include "waymark/codecs/formats.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Place place_of(const fs::path& path) { return {.source = path.string()}; }

std::string reason(int error) { return std::generic_category().message(error); }

Result<File> open_to_read(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return fail(ErrorCode::Unreadable, "is a folder, not an image", place_of(path),
                "Name an image file in it.");
  }
  // Opened in non-blocking mode, because opening a pipe without a writer would otherwise block forever.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  struct stat info {};
  if (descriptor >= 0 && ::fstat(descriptor, &info) == 0 && S_ISFIFO(info.st_mode)) {
    ::close(descriptor);
    return fail(ErrorCode::Unreadable, "is a pipe, not an image", place_of(path),
                "Write the image to a file first.");
  }
  File file(descriptor >= 0 ? ::fdopen(descriptor, "rb") : nullptr);
  if (file) return file;
  const ErrorCode code = errno == ENOENT || errno == ENOTDIR ? ErrorCode::NotFound : ErrorCode::Unreadable;
  return fail(code, fmt::format("cannot open this image: {}", reason(errno)), place_of(path),
              "Check the path.");
}

/// Reads the whole file; stops early if it does not begin like an image, because it may be endless.
Result<std::vector<std::uint8_t>> read_bytes(const fs::path& path) {
  Result<File> file = open_to_read(path);
  if (!file) return tl::unexpected(file.error());
  const std::string name = path.string();
  constexpr std::size_t kChunk = std::size_t{1} << 18;
  std::vector<std::uint8_t> bytes;
  for (bool more = true; more;) {
    const std::size_t before = bytes.size();
    bytes.resize(before + kChunk);
    const std::size_t count = std::fread(bytes.data() + before, 1, kChunk, file->get());
    bytes.resize(before + count);
    if (std::ferror(file->get()) != 0) {
      return fail(ErrorCode::Unreadable, fmt::format("cannot read this image: {}", reason(errno)),
                  place_of(path));
    }
    more = count == kChunk;
    if (before == 0 && more) {
      if (const auto format = codecs::recognise({bytes, name}); !format)
        return tl::unexpected(format.error());
    }
  }
  return bytes;
}

/// Converts an out-of-memory exception (due to a large file) to an Error, because exceptions must not leave
/// the room.
Result<std::vector<std::uint8_t>> read_all(const fs::path& path) {
  try {
    return read_bytes(path);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::LimitExceeded, "not enough memory for this file", place_of(path));
  }
}

std::string lower_suffix(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return suffix;
}

template <class AnyImage>
Result<std::vector<std::uint8_t>> encode_for(const fs::path& path, const AnyImage& image, bool color) {
  const std::string suffix = lower_suffix(path);
  if (suffix == ".png") return encode_png(image);
  if (suffix == ".jpg" || suffix == ".jpeg") return encode_jpeg(image, kJpegFileQuality);
  if (suffix == ".pnm" || suffix == (color ? ".ppm" : ".pgm")) return encode_pnm(image);
  if (suffix == ".pgm" || suffix == ".ppm") {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a {} image cannot be written as {}", color ? "colour" : "grey", suffix),
                place_of(path), fmt::format("Use {}, .pnm or .png.", color ? ".ppm" : ".pgm"));
  }
  return fail(
      ErrorCode::InvalidArgument,
      suffix.empty() ? "the file name has no suffix" : fmt::format("unknown image format '{}'", suffix),
      place_of(path), "Use .png, .jpg, .pgm, .ppm or .pnm.");
}

template <class AnyImage>
Status encode_and_write(const fs::path& path, const AnyImage& image, bool color) {
  const auto bytes = encode_for(path, image, color);
  if (bytes) return write_bytes(path, *bytes);
  Error error = bytes.error();
  if (error.place.source.empty()) error.place.source = path.string();
  return tl::unexpected(error);
}

tl::unexpected<Error> cannot_create(const fs::path& path, int error) {
  std::error_code ignored;
  const fs::path folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored)) {
    return fail(ErrorCode::Unwritable, fmt::format("missing folder {}", folder.string()), place_of(path),
                "Create the folder or choose another.");
  }
  return fail(ErrorCode::Unwritable, fmt::format("cannot create this file: {}", reason(error)),
              place_of(path), write_hint(error, folder.string()));
}

}  // namespace

Result<Image> read_image(const fs::path& path, const DecodeOptions& options) {
  const auto bytes = read_all(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path.string(), options);
}

Result<ImageInfo> probe_image(const fs::path& path) {
  const auto bytes = read_all(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return probe(*bytes, path.string());
}

Status write_image(const fs::path& path, const ImageView& image) {
  return encode_and_write(path, image, false);
}
Status write_image(const fs::path& path, const ColorImage& image) {
  return encode_and_write(path, image, true);
}

Status write_bytes(const fs::path& path, std::span<const std::uint8_t> bytes) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return cannot_create(path, errno);
  errno = 0;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  int error = written ? 0 : errno;
  if (std::fclose(file) != 0 && error == 0)
    error = errno;  // a full disk may be reported only when buffered data are flushed
  if (written && error == 0) return {};
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) fs::remove(path, ignored);
  return fail(ErrorCode::Unwritable, fmt::format("cannot complete this file: {}", reason(error)),
              place_of(path), write_hint(error, path.parent_path().string()));
}

}  // namespace waymark
