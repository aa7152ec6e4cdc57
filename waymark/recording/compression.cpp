#include "waymark/recording/compression.hpp"

#include <array>
#include <memory>

#include <fmt/format.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

namespace waymark {
namespace {

tl::unexpected<Error> damaged(std::string_view kind, std::string_view why) {
  return fail(ErrorCode::Unreadable, fmt::format("a chunk packed with {} is damaged ({})", kind, why));
}

Status compress_zstd(ByteSpan bytes, Bytes& out) {
  const std::size_t at = out.size();
  out.resize(at + ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data() + at, out.size() - at, bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(size) != 0)
    return fail(ErrorCode::Unwritable, fmt::format("zstd: {}", ZSTD_getErrorName(size)));
  out.resize(at + size);
  return {};
}

Status compress_lz4(ByteSpan bytes, Bytes& out) {
  const std::size_t at = out.size();
  out.resize(at + LZ4F_compressFrameBound(bytes.size(), nullptr));
  const std::size_t size =
      LZ4F_compressFrame(out.data() + at, out.size() - at, bytes.data(), bytes.size(), nullptr);
  if (LZ4F_isError(size) != 0)
    return fail(ErrorCode::Unwritable, fmt::format("lz4: {}", LZ4F_getErrorName(size)));
  out.resize(at + size);
  return {};
}

Result<ByteSpan> decompress_zstd(ByteSpan packed, std::size_t size, Bytes& room) {
  const unsigned long long promised = ZSTD_getFrameContentSize(packed.data(), packed.size());
  const bool known = promised != ZSTD_CONTENTSIZE_UNKNOWN;
  if (promised == ZSTD_CONTENTSIZE_ERROR) return damaged("zstd", "not a zstd frame");
  // Before anything is allocated. Several frames one after the other may hold more than the first says.
  if (known && promised > size) return damaged("zstd", fmt::format("{} bytes instead of {}", promised, size));
  room.resize(size);
  const std::size_t got = ZSTD_decompress(room.data(), room.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0) return damaged("zstd", ZSTD_getErrorName(got));
  if (got != size) return damaged("zstd", fmt::format("{} bytes instead of {}", got, size));
  return ByteSpan(room);
}

Result<ByteSpan> decompress_lz4(ByteSpan packed, std::size_t size, Bytes& room) {
  constexpr std::size_t kMostRatio = 255;  // of the format (LZ4 block format, "Compressed block format")
  if (size / kMostRatio > packed.size())
    return damaged("lz4", fmt::format("{} bytes cannot hold {}", packed.size(), size));
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0)
    return damaged("lz4", "out of memory");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(raw,
                                                                             LZ4F_freeDecompressionContext);
  room.resize(size);
  std::size_t filled = 0;
  std::size_t used = 0;
  std::size_t more = 1;  // 0 when the frame has ended
  while (more != 0 && used < packed.size()) {
    std::size_t out = room.size() - filled;
    std::size_t in = packed.size() - used;
    more = LZ4F_decompress(context.get(), room.data() + filled, &out, packed.data() + used, &in, nullptr);
    if (LZ4F_isError(more) != 0) return damaged("lz4", LZ4F_getErrorName(more));
    if (out == 0 && in == 0) break;  // wants more room than there may be
    filled += out;
    used += in;
  }
  if (more != 0 || filled != size) return damaged("lz4", fmt::format("{} bytes instead of {}", filled, size));
  return ByteSpan(room);
}

}  // namespace

Result<Compression> parse_compression(std::string_view name) {
  if (name.empty()) return Compression::None;
  if (name == "lz4") return Compression::Lz4;
  if (name == "zstd") return Compression::Zstd;
  return fail(ErrorCode::Unsupported, fmt::format("chunks packed with '{}' cannot be read", name), {},
              "Known: lz4, zstd.");
}

std::string_view to_string(Compression compression) {
  switch (compression) {
    case Compression::None:
      return "";
    case Compression::Lz4:
      return "lz4";
    case Compression::Zstd:
      return "zstd";
  }
  return "";
}

Status compress(Compression compression, ByteSpan bytes, Bytes& out) {
  switch (compression) {
    case Compression::Lz4:
      return compress_lz4(bytes, out);
    case Compression::Zstd:
      return compress_zstd(bytes, out);
    case Compression::None:
      break;
  }
  append(out, bytes);
  return {};
}

Result<ByteSpan> decompress(Compression compression, ByteSpan packed, std::uint64_t size, Bytes& room) {
  switch (compression) {
    case Compression::Lz4:
      return decompress_lz4(packed, static_cast<std::size_t>(size), room);
    case Compression::Zstd:
      return decompress_zstd(packed, static_cast<std::size_t>(size), room);
    case Compression::None:
      break;
  }
  if (packed.size() != size)
    return damaged("nothing", fmt::format("{} bytes instead of {}", packed.size(), size));
  return packed;
}

std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier) {
  return libdeflate_crc32(earlier, bytes.data(), bytes.size());
}

namespace {

// Polynomials over GF(2) modulo that of CRC-32, the highest bit first (bit 31 is x^0), as in zlib's
// crc32_combine().
constexpr std::uint32_t multiply(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kPolynomial = 0xEDB88320;
  std::uint32_t product = 0;
  for (std::uint32_t bit = 1U << 31U; bit != 0; bit >>= 1U) {
    if ((a & bit) != 0) product ^= b;
    b = (b & 1U) != 0 ? (b >> 1U) ^ kPolynomial : b >> 1U;
  }
  return product;
}

/// x^8, x^16, x^32, …: shifts by 1, 2, 4, … bytes.
constexpr std::array<std::uint32_t, 64> kShifts = [] {
  std::array<std::uint32_t, 64> shifts{};
  std::uint32_t shift = 1U << 23U;
  for (std::uint32_t& entry : shifts) {
    entry = shift;
    shift = multiply(shift, shift);
  }
  return shifts;
}();

}  // namespace

std::uint32_t crc32_of_both(std::uint32_t first, std::uint32_t second, std::uint64_t second_size) {
  for (std::size_t bit = 0; second_size >> bit != 0; ++bit)
    if (((second_size >> bit) & 1U) != 0) first = multiply(kShifts[bit], first);
  return first ^ second;
}

}  // namespace waymark
