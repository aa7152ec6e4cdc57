#include "waymark/codecs/formats.hpp"

#include <array>

#include <fmt/format.h>

namespace waymark::codecs {
namespace {

/// Magic bytes of a file type: `magic` at `offset`.
struct Signature {
  std::size_t offset;
  std::string_view magic;
  std::string_view what;
};

using namespace std::string_view_literals;
constexpr std::string_view kConvert =
    "Convert it to PNG or JPEG, e.g. with ImageMagick: convert in.xyz out.png.";
constexpr std::array kForeign = {
    Signature{0, "GIF8"sv, "a GIF image"},
    Signature{8, "WEBP"sv, "a WebP image"},
    Signature{0, "II*\0"sv, "a TIFF image (or a camera's raw file)"},
    Signature{0, "MM\0*"sv, "a TIFF image (or a camera's raw file)"},
    Signature{0, "II+\0"sv, "a BigTIFF image"},
    Signature{0, "%PDF"sv, "a PDF document"},
    Signature{4, "ftypheic"sv, "a HEIC image"},
    Signature{4, "ftypheix"sv, "a HEIC image"},
    Signature{4, "ftypmif1"sv, "a HEIF image"},
    Signature{4, "ftypavif"sv, "an AVIF image"},
    Signature{4, "ftyp"sv, "an MP4 or QuickTime video"},
    Signature{0, "BM"sv, "a BMP image"},
    Signature{0, "P1"sv, "a PBM bitmap"},
    Signature{0, "P4"sv, "a PBM bitmap"},
    Signature{0, "P7"sv, "a PAM image"},
    Signature{0, "Pf"sv, "a PFM image"},
    Signature{0, "PF"sv, "a PFM image"},
    Signature{4, "jP  "sv, "a JPEG 2000 image"},
    Signature{0, "\xff\x0a"sv, "a JPEG XL image"},
    Signature{4, "JXL "sv, "a JPEG XL image"},
    Signature{0, "\x89MCAP"sv, "an MCAP recording"},
    Signature{0, "\x1a\x45\xdf\xa3"sv, "a Matroska or WebM video"},
    Signature{0, "RIFF"sv, "a RIFF file (AVI video?)"},
    Signature{0, "<svg"sv, "an SVG drawing"},
    Signature{0, "<?xml"sv, "an XML file (SVG drawing?)"},
    Signature{0, "<!DOCTYPE"sv, "a web page"},
    Signature{0, "<html"sv, "a web page"},
    Signature{0, "version https://git-lfs"sv, "a Git LFS pointer instead of the file itself"},
};

std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool begins(std::string_view text, const Signature& signature) {
  return text.size() > signature.offset && text.substr(signature.offset).starts_with(signature.magic);
}

}  // namespace

Result<ImageFormat> recognise(const Input& input) {
  const std::string_view text = as_text(input.bytes);
  if (text.empty())
    return fail(ErrorCode::Unreadable, "empty file instead of an image", input.whole(),
                "Take or copy the image again.");
  if (const auto format = image_format_of(input.bytes)) return *format;
  for (const Signature& signature : kForeign) {
    if (begins(text, signature)) {
      return fail(ErrorCode::Unsupported, fmt::format("{} is not supported", signature.what), input.whole(),
                  std::string(kConvert));
    }
  }
  for (const std::string_view start : {"\xff\xd8\xff"sv, "\x89PNG\r\n\x1a\n"sv, "P5"sv}) {
    if (start.starts_with(text)) return cut_short(input, "image is truncated within its first bytes");
  }
  return fail(ErrorCode::Unreadable, "not an image: the first bytes are not those of JPEG, PNG or PNM",
              input.at(0), "Check that this is the right file.");
}

Status check_limit(const ImageInfo& info, const Input& input, const DecodeOptions& options) {
  const std::int64_t pixels = std::int64_t{info.width} * info.height;
  if (pixels > options.max_pixels) {
    return fail(
        ErrorCode::LimitExceeded,
        fmt::format("image of {} x {} px, more than {} pixels", info.width, info.height, options.max_pixels),
        input.whole(), "Reduce its size or raise `max_pixels`.");
  }
  return {};
}

tl::unexpected<Error> cut_short(const Input& input, std::string message) {
  return fail(ErrorCode::Unreadable, std::move(message), input.at(input.bytes.size()),
              "The file is truncated. Copy it again from its source.");
}

}  // namespace waymark::codecs
