#include "waymark/media/luma_plane.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <cstring>

#include <fmt/format.h>

namespace waymark::internal {
namespace {

/// One component of one row, as eight bits.
class Component {
 public:
  Component(const AVFrame& frame, const AVPixFmtDescriptor& format, std::size_t which)
      : from_(format.comp[which]),
        data_(frame.data[from_.plane]),
        stride_(frame.linesize[from_.plane]),
        big_endian_((format.flags & AV_PIX_FMT_FLAG_BE) != 0) {}

  [[nodiscard]] bool plain() const { return from_.depth == 8 && from_.shift == 0; }
  [[nodiscard]] const std::uint8_t* row(int y) const {
    return data_ + static_cast<std::ptrdiff_t>(y) * stride_ + from_.offset;
  }
  [[nodiscard]] std::uint8_t at(int x, int y) const {
    const std::uint8_t* sample = row(y) + static_cast<std::ptrdiff_t>(x) * from_.step;
    if (from_.depth + from_.shift <= 8) return scaled(static_cast<unsigned>(*sample) >> from_.shift);
    const unsigned word = big_endian_ ? static_cast<unsigned>(sample[0] << 8 | sample[1])
                                      : static_cast<unsigned>(sample[1] << 8 | sample[0]);
    return scaled(word >> from_.shift);
  }

 private:
  [[nodiscard]] std::uint8_t scaled(unsigned value) const {
    value &= (1U << from_.depth) - 1;
    if (from_.depth >= 8) return static_cast<std::uint8_t>(value >> (from_.depth - 8));
    return static_cast<std::uint8_t>(value * 255 / ((1U << from_.depth) - 1));
  }

  AVComponentDescriptor from_;
  const std::uint8_t* data_;
  std::ptrdiff_t stride_;
  bool big_endian_;
};

void fill_grey(const AVFrame& frame, const AVPixFmtDescriptor& format, Image& storage) {
  const Component luma(frame, format, 0);
  const bool whole_rows = luma.plain() && format.comp[0].step == 1;
  for (int y = 0; y < frame.height; ++y) {
    std::uint8_t* to = storage.row(y);
    if (whole_rows)
      std::memcpy(to, luma.row(y), static_cast<std::size_t>(frame.width));
    else
      for (int x = 0; x < frame.width; ++x) to[x] = luma.at(x, y);
  }
}

void fill_from_rgb(const AVFrame& frame, const AVPixFmtDescriptor& format, Image& storage) {
  const Component r(frame, format, 0), g(frame, format, 1), b(frame, format, 2);
  for (int y = 0; y < frame.height; ++y) {
    std::uint8_t* to = storage.row(y);
    for (int x = 0; x < frame.width; ++x) {
      const unsigned grey = 299U * r.at(x, y) + 587U * g.at(x, y) + 114U * b.at(x, y);
      to[x] = static_cast<std::uint8_t>((grey + 500) / 1000);
    }
  }
}

}  // namespace

Result<ImageView> luma_of(const Libav& av, const AVFrame& frame, Image& storage) {
  const AVPixFmtDescriptor* format = av.av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
  constexpr std::uint64_t kUnknown = AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM |
                                     AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_FLOAT;
  if (format == nullptr || (format->flags & kUnknown) != 0 || format->nb_components < 1 ||
      format->comp[0].depth > 16)
    return fail(ErrorCode::Unsupported, fmt::format("pictures of pixel format {} are not read",
                                                    format == nullptr ? "unknown" : format->name));
  if (frame.width <= 0 || frame.height <= 0 || frame.data[0] == nullptr)
    return fail(ErrorCode::Unreadable, "a picture without pixels");
  const bool rgb = (format->flags & AV_PIX_FMT_FLAG_RGB) != 0 && format->nb_components >= 3;
  const AVComponentDescriptor& luma = format->comp[0];
  const bool as_it_lies = !rgb && luma.depth == 8 && luma.shift == 0 && luma.step == 1 && luma.offset == 0 &&
                          frame.linesize[luma.plane] >= frame.width;
  if (as_it_lies)
    return ImageView{frame.data[luma.plane], frame.width, frame.height, frame.linesize[luma.plane]};
  if (storage.width() != frame.width || storage.height() != frame.height)
    storage = Image(frame.width, frame.height);
  if (rgb)
    fill_from_rgb(frame, *format, storage);
  else
    fill_grey(frame, *format, storage);
  return storage.view();
}

}  // namespace waymark::internal

#endif
