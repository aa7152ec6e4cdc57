#include "waymark/codecs/formats.hpp"

#include <array>

#include <fmt/format.h>

namespace waymark::codecs {
namespace {

/// How a file of some kind begins: `magic` at `offset`.
struct Signature {
  std::size_t offset;
  std::string_view magic;
  std::string_view what;
};

using namespace std::string_view_literals;
constexpr std::string_view kConvert =
    "Convert it to PNG or JPEG, e.g. with ImageMagick: convert in.xyz out.png.";
constexpr std::array kForeign = {
    Signature{0, "GIF8"sv, "a GIF picture"},
    Signature{8, "WEBP"sv, "a WebP picture"},
    Signature{0, "II*\0"sv, "a TIFF picture (or a camera's raw file)"},
    Signature{0, "MM\0*"sv, "a TIFF picture (or a camera's raw file)"},
    Signature{0, "II+\0"sv, "a BigTIFF picture"},
    Signature{0, "%PDF"sv, "a PDF document"},
    Signature{4, "ftypheic"sv, "a HEIC picture"},
    Signature{4, "ftypheix"sv, "a HEIC picture"},
    Signature{4, "ftypmif1"sv, "a HEIF picture"},
    Signature{4, "ftypavif"sv, "an AVIF picture"},
    Signature{4, "ftyp"sv, "an MP4 or QuickTime video"},
    Signature{0, "BM"sv, "a BMP picture"},
    Signature{0, "P1"sv, "a PBM bitmap"},
    Signature{0, "P4"sv, "a PBM bitmap"},
    Signature{0, "P7"sv, "a PAM picture"},
    Signature{0, "Pf"sv, "a PFM picture"},
    Signature{0, "PF"sv, "a PFM picture"},
    Signature{4, "jP  "sv, "a JPEG 2000 picture"},
    Signature{0, "\xff\x0a"sv, "a JPEG XL picture"},
    Signature{4, "JXL "sv, "a JPEG XL picture"},
    Signature{0, "\x89MCAP"sv, "an MCAP recording"},
    Signature{0, "\x1a\x45\xdf\xa3"sv, "a Matroska or WebM video"},
    Signature{0, "RIFF"sv, "a RIFF file (AVI video?)"},
    Signature{0, "<svg"sv, "an SVG drawing"},
    Signature{0, "<?xml"sv, "an XML file (SVG drawing?)"},
    Signature{0, "<!DOCTYPE"sv, "a web page"},
    Signature{0, "<html"sv, "a web page"},
    Signature{0, "version https://git-lfs"sv, "a Git LFS pointer, not the file it stands for"},
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
    return fail(ErrorCode::Unreadable, "empty file where a picture was expected", input.whole(),
                "Take or copy the picture again.");
  if (const auto format = image_format_of(input.bytes)) return *format;
  for (const Signature& signature : kForeign) {
    if (begins(text, signature)) {
      return fail(ErrorCode::Unsupported, fmt::format("looks like {}, which is not read", signature.what),
                  input.whole(), std::string(kConvert));
    }
  }
  for (const std::string_view start : {"\xff\xd8\xff"sv, "\x89PNG\r\n\x1a\n"sv, "P5"sv}) {
    if (start.starts_with(text)) return cut_short(input, "picture ends within its first bytes");
  }
  return fail(ErrorCode::Unreadable, "not a picture: neither JPEG, PNG nor PNM by its first bytes",
              input.at(0), "Check that this is the right file.");
}

Status check_limit(const ImageInfo& info, const Input& input, const DecodeOptions& options) {
  const std::int64_t pixels = std::int64_t{info.width} * info.height;
  if (pixels > options.max_pixels) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("picture of {} x {} px, more than {} pixels", info.width, info.height,
                            options.max_pixels),
                input.whole(), "Make it smaller or raise max_pixels.");
  }
  return {};
}

tl::unexpected<Error> cut_short(const Input& input, std::string message) {
  return fail(ErrorCode::Unreadable, std::move(message), input.at(input.bytes.size()),
              "The file is cut short: copy it again from its source.");
}

}  // namespace waymark::codecs
