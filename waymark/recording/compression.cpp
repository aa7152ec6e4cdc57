#include "waymark/recording/compression.hpp"

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

Result<Bytes> compress_zstd(ByteSpan bytes) {
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(size) != 0)
    return fail(ErrorCode::Unwritable, fmt::format("zstd: {}", ZSTD_getErrorName(size)));
  packed.resize(size);
  return packed;
}

Result<Bytes> compress_lz4(ByteSpan bytes) {
  Bytes packed(LZ4F_compressFrameBound(bytes.size(), nullptr));
  const std::size_t size =
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr);
  if (LZ4F_isError(size) != 0)
    return fail(ErrorCode::Unwritable, fmt::format("lz4: {}", LZ4F_getErrorName(size)));
  packed.resize(size);
  return packed;
}

Result<Bytes> decompress_zstd(ByteSpan packed, std::size_t size) {
  Bytes bytes(size);
  const std::size_t got = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0) return damaged("zstd", ZSTD_getErrorName(got));
  if (got != size) return damaged("zstd", fmt::format("{} bytes instead of {}", got, size));
  return bytes;
}

Result<Bytes> decompress_lz4(ByteSpan packed, std::size_t size) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0)
    return damaged("lz4", "out of memory");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(raw,
                                                                             LZ4F_freeDecompressionContext);
  Bytes bytes(size);
  std::size_t filled = 0;
  std::size_t used = 0;
  std::size_t more = 1;  // 0 when the frame has ended
  while (more != 0 && used < packed.size()) {
    std::size_t out = bytes.size() - filled;
    std::size_t in = packed.size() - used;
    more = LZ4F_decompress(context.get(), bytes.data() + filled, &out, packed.data() + used, &in, nullptr);
    if (LZ4F_isError(more) != 0) return damaged("lz4", LZ4F_getErrorName(more));
    if (out == 0 && in == 0) break;  // wants more room than there may be
    filled += out;
    used += in;
  }
  if (more != 0 || filled != size) return damaged("lz4", fmt::format("{} bytes instead of {}", filled, size));
  return bytes;
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

Result<Bytes> compress(Compression compression, ByteSpan bytes) {
  switch (compression) {
    case Compression::Lz4:
      return compress_lz4(bytes);
    case Compression::Zstd:
      return compress_zstd(bytes);
    case Compression::None:
      break;
  }
  return Bytes(bytes.begin(), bytes.end());
}

Result<Bytes> decompress(Compression compression, ByteSpan packed, std::uint64_t size) {
  switch (compression) {
    case Compression::Lz4:
      return decompress_lz4(packed, static_cast<std::size_t>(size));
    case Compression::Zstd:
      return decompress_zstd(packed, static_cast<std::size_t>(size));
    case Compression::None:
      break;
  }
  if (packed.size() != size)
    return damaged("nothing", fmt::format("{} bytes instead of {}", packed.size(), size));
  return Bytes(packed.begin(), packed.end());
}

std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier) {
  return libdeflate_crc32(earlier, bytes.data(), bytes.size());
}

}  // namespace waymark
