// PNM consists of a short header and raw samples (Poskanzer, manual pages pgm(5) and ppm(5)); using a library
// would take more code.
#include "waymark/codecs/pnm.hpp"

#include <array>
#include <limits>

#include <fmt/format.h>

namespace waymark::codecs {
namespace {

constexpr std::uint64_t kLargestNumber = std::numeric_limits<std::int32_t>::max();

bool is_space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool is_digit(std::uint8_t c) { return c >= '0' && c <= '9'; }

struct Header {
  ImageInfo info;
  std::uint64_t max = 255;
  bool text = false;       ///< P2, P3: samples as decimal words
  std::size_t pixels = 0;  ///< offset of the first sample

  [[nodiscard]] std::uint64_t samples() const {
    return static_cast<std::uint64_t>(info.width) * static_cast<std::uint64_t>(info.height) *
           static_cast<std::uint64_t>(info.channels);
  }
};

/// Tokenizer for PNM.
class Reader {
 public:
  Reader(const Input& input, std::size_t position) : input_(input), position_(position) {}

  /// The next decimal number, at most `largest`; comments run from # to the end of the line.
  Result<std::uint64_t> number(const char* what, std::uint64_t largest) {
    skip_space_and_comments();
    const std::size_t start = position_;
    std::uint64_t value = 0;
    for (; position_ < size() && is_digit(input_.bytes[position_]); ++position_) {
      value = 10 * value + (input_.bytes[position_] - '0');
      if (value > largest) {
        return fail(ErrorCode::Unreadable, fmt::format("PNM {} is more than {}", what, largest),
                    input_.at(start));
      }
    }
    if (position_ > start) return value;
    if (position_ >= size()) return cut_short(input_, fmt::format("PNM ends before its {}", what));
    return fail(ErrorCode::Unreadable, fmt::format("PNM {} is not a decimal number", what), input_.at(start));
  }

  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  [[nodiscard]] std::size_t size() const { return input_.bytes.size(); }

  void skip_space_and_comments() {
    while (position_ < size() && (is_space(input_.bytes[position_]) || input_.bytes[position_] == '#')) {
      if (input_.bytes[position_] == '#') {
        while (position_ < size() && input_.bytes[position_] != '\n' && input_.bytes[position_] != '\r')
          ++position_;
      } else {
        ++position_;
      }
    }
  }

  Input input_;
  std::size_t position_;
};

int bits_for(std::uint64_t max) {
  int bits = 0;
  for (; max > 0; max >>= 1U) ++bits;
  return bits;
}

Result<Header> read_header(const Input& input) {
  Header header;
  const char kind = static_cast<char>(input.bytes[1]);
  header.text = kind == '2' || kind == '3';
  Reader reader(input, 2);
  const auto width = reader.number("width", kLargestNumber);
  if (!width) return tl::unexpected(width.error());
  const auto height = reader.number("height", kLargestNumber);
  if (!height) return tl::unexpected(height.error());
  const auto max = reader.number("maximum", 65535);
  if (!max) return tl::unexpected(max.error());
  if (*width == 0 || *height == 0 || *max == 0) {
    return fail(ErrorCode::Unreadable,
                fmt::format("PNM of {} x {} px with maximum {}", *width, *height, *max), input.at(2));
  }
  if (reader.position() >= input.bytes.size()) return cut_short(input, "PNM ends after its header");
  if (!is_space(input.bytes[reader.position()])) {
    return fail(ErrorCode::Unreadable, "no white space after the PNM header", input.at(reader.position()));
  }
  header.pixels = reader.position() + 1;
  header.max = *max;
  header.info = {.format = ImageFormat::Pnm,
                 .width = static_cast<int>(*width),
                 .height = static_cast<int>(*height),
                 .channels = kind == '3' || kind == '6' ? 3 : 1,
                 .bits_per_channel = bits_for(*max)};
  return header;
}

/// Checks, before allocation, that the input can contain all samples that the header claims.
Status check_complete(const Input& input, const Header& header) {
  const std::uint64_t there = input.bytes.size() - header.pixels;
  const std::uint64_t bytes_each = header.max > 255 ? 2 : 1;
  // In text, each sample has at least one digit and samples are separated by white space. samples() < 2^63 *
  // 3 cannot be doubled without overflow, so `there` is halved.
  const bool complete =
      header.text ? header.samples() <= there / 2 + 1 : header.samples() <= there / bytes_each;
  if (complete) return {};
  return cut_short(input, fmt::format("PNM of {} x {} px with {} bytes of samples", header.info.width,
                                      header.info.height, there));
}

tl::unexpected<Error> too_large(std::uint64_t value, std::uint64_t max, Place place) {
  return fail(ErrorCode::Unreadable, fmt::format("PNM sample {} is above its maximum {}", value, max),
              std::move(place));
}

/// Samples as decimal words (P2, P3).
class TextSamples {
 public:
  TextSamples(const Input& input, const Header& header) : max_(header.max), reader_(input, header.pixels) {}
  Result<std::uint64_t> next() { return reader_.number("sample", max_); }

 private:
  std::uint64_t max_;
  Reader reader_;
};

/// Samples as bytes, or as big-endian byte pairs if the maximum exceeds 255 (P5, P6).
class RawSamples {
 public:
  RawSamples(const Input& input, const Header& header)
      : max_(header.max), position_(header.pixels), input_(input) {}
  Result<std::uint64_t> next() {
    std::uint64_t value = input_.bytes[position_++];
    if (max_ > 255) value = (value << 8U) + input_.bytes[position_++];
    if (value > max_) return too_large(value, max_, input_.at(position_ - 1));
    return value;
  }

 private:
  std::uint64_t max_;
  std::size_t position_;
  Input input_;
};

/// Fills the image from TextSamples or RawSamples.
template <class Samples>
Status fill(Image& image, const Header& header, Samples samples) {
  std::array<std::uint64_t, 3> pixel{};
  const std::span<std::uint64_t> channels =
      std::span(pixel).first(static_cast<std::size_t>(header.info.channels));
  for (int y = 0; y < image.height(); ++y) {
    std::uint8_t* to = image.row(y);
    for (int x = 0; x < image.width(); ++x) {
      for (std::uint64_t& channel : channels) {
        const Result<std::uint64_t> sample = samples.next();
        if (!sample) return tl::unexpected(sample.error());
        channel = *sample;
      }
      to[x] = channels.size() == 1 ? grey_byte(pixel[0], header.max)
                                   : grey_byte(pixel[0], pixel[1], pixel[2], header.max);
    }
  }
  return {};
}

}  // namespace

Result<ImageInfo> probe_pnm(const Input& input) {
  return read_header(input).map([](const Header& header) { return header.info; });
}

Result<Image> decode_pnm(const Input& input, const DecodeOptions& options) {
  const Result<Header> header = read_header(input);
  if (!header) return tl::unexpected(header.error());
  if (const Status complete = check_complete(input, *header); !complete)
    return tl::unexpected(complete.error());
  if (const Status within = check_limit(header->info, input, options); !within)
    return tl::unexpected(within.error());
  Image image(header->info.width, header->info.height);
  const Status filled = header->text ? fill(image, *header, TextSamples(input, *header))
                                     : fill(image, *header, RawSamples(input, *header));
  if (!filled) return tl::unexpected(filled.error());
  return image;
}

Bytes encode_pnm(const Pixels& pixels) {
  const std::string header =
      fmt::format("P{}\n{} {}\n255\n", pixels.channels == 3 ? 6 : 5, pixels.width, pixels.height);
  std::vector<std::uint8_t> bytes(header.begin(), header.end());
  const std::size_t row_bytes =
      static_cast<std::size_t>(pixels.width) * static_cast<std::size_t>(pixels.channels);
  bytes.reserve(bytes.size() + row_bytes * static_cast<std::size_t>(pixels.height));
  for (int y = 0; y < pixels.height; ++y) bytes.insert(bytes.end(), pixels.row(y), pixels.row(y) + row_bytes);
  return bytes;
}

}  // namespace waymark::codecs
