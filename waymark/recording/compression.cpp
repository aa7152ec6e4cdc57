#include "waymark/recording/compression.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include <bzlib.h>
#include <fmt/format.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "waymark/recording/byte_file.hpp"

namespace waymark {
namespace {

tl::unexpected<Error> damaged(std::string_view kind, std::string_view why) {
  return fail(ErrorCode::Unreadable, fmt::format("damaged {} chunk ({})", kind, why));
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
  // Checked before allocation. With several concatenated frames, the total may exceed the size in the first
  // header.
  if (known && promised > size) return damaged("zstd", fmt::format("{} bytes instead of {}", promised, size));
  room.resize(size);
  const std::size_t got = ZSTD_decompress(room.data(), room.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0) return damaged("zstd", ZSTD_getErrorName(got));
  if (got != size) return damaged("zstd", fmt::format("{} bytes instead of {}", got, size));
  return ByteSpan(room);
}

Result<ByteSpan> decompress_lz4(ByteSpan packed, std::size_t size, Bytes& room) {
  constexpr std::size_t kMaxRatio = 255;  // limit of the format (LZ4 block format, "Compressed block format")
  if (size / kMaxRatio > packed.size())
    return damaged("lz4", fmt::format("{} bytes cannot hold {}", packed.size(), size));
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0)
    return damaged("lz4", "out of memory");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(raw,
                                                                             LZ4F_freeDecompressionContext);
  room.resize(size);
  std::size_t filled = 0;
  std::size_t used = 0;
  std::size_t more = 1;  // 0 once the frame has ended
  while (more != 0 && used < packed.size()) {
    std::size_t out = room.size() - filled;
    std::size_t in = packed.size() - used;
    more = LZ4F_decompress(context.get(), room.data() + filled, &out, packed.data() + used, &in, nullptr);
    if (LZ4F_isError(more) != 0) return damaged("lz4", LZ4F_getErrorName(more));
    if (out == 0 && in == 0) break;  // more output than `size` is needed
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
  return fail(ErrorCode::Unsupported, fmt::format("unsupported chunk compression '{}'", name), {},
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
    return damaged("uncompressed", fmt::format("{} bytes instead of {}", packed.size(), size));
  return packed;
}

std::uint32_t crc32(ByteSpan bytes, std::uint32_t earlier) {
  return libdeflate_crc32(earlier, bytes.data(), bytes.size());
}

namespace {

// Polynomials over GF(2) modulo the CRC-32 polynomial, highest coefficient first (bit 31 is x^0), as in
// zlib's crc32_combine().
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

namespace {

constexpr std::size_t kPiece = 1 << 16;

/// An unpacked file; keeps the temporary file alive while it is read.
class UnpackedSource final : public ByteSource {
 public:
  UnpackedSource(std::shared_ptr<const TemporaryFile> file, std::string name)
      : file_(std::move(file)), name_(std::move(name)) {}
  Result<std::uint64_t> size() const override { return file_->size(); }
  Status read(std::uint64_t offset, std::span<std::uint8_t> out) const override {
    Status status = file_->read(offset, out);
    if (!status) status.error().place.source = name_;
    return status;
  }
  std::string name() const override { return name_; }
  std::shared_ptr<const TemporaryFile> file() const { return file_; }

 private:
  std::shared_ptr<const TemporaryFile> file_;
  std::string name_;
};

Error too_much(std::uint64_t max) {
  return {ErrorCode::LimitExceeded,
          fmt::format("unpacks to more than {} bytes", max),
          {},
          "If this size is intended, unpack the file yourself."};
}

/// Writes unpacked bytes to a temporary file within the limits.
class BoundedFile {
 public:
  BoundedFile(std::shared_ptr<TemporaryFile> file, std::uint64_t packed_bytes, const UnpackLimits& limits)
      : file_(std::move(file)), max_bytes_(limits.max_unpacked_bytes(packed_bytes)), limits_(limits) {}

  Status take(ByteSpan piece) {
    if (piece.size() > max_bytes_ - file_->size()) return refused(too_much(max_bytes_));
    if (limits_.stop()) return refused({ErrorCode::LimitExceeded, "stopped while unpacking", {}, {}});
    if (file_->size() >= check_at_) {
      constexpr std::uint64_t kBetweenChecks = std::uint64_t{1} << 24U;
      check_at_ = file_->size() + kBetweenChecks;
      if (file_->free_bytes() < limits_.keep_free_bytes)
        return refused({ErrorCode::LimitExceeded,
                        fmt::format("unpacking it would leave less than {} bytes free on the disk of the "
                                    "temporary folder",
                                    limits_.keep_free_bytes),
                        {},
                        "Set TMPDIR to a folder with more free space, or unpack the file yourself."});
    }
    Status status = file_->append(piece);
    if (!status) refusal = status.error();
    return status;
  }

  std::optional<Error> refusal{};  ///< a limit was exceeded, which is not damage

 private:
  Status refused(Error error) {
    refusal = std::move(error);
    return tl::unexpected(*refusal);
  }

  std::shared_ptr<TemporaryFile> file_;
  std::uint64_t max_bytes_;
  const UnpackLimits& limits_;
  std::uint64_t check_at_ = 0;
};

}  // namespace

const char* to_string(Packing packing) {
  constexpr std::array<const char*, 5> kNames = {"no", "bzip2", "gzip", "zstd", "lz4"};
  return kNames.at(static_cast<std::size_t>(packing));
}

Packing packing_of(ByteSpan head) {
  if (head.size() < 4) return Packing::None;
  if (head[0] == 'B' && head[1] == 'Z' && head[2] == 'h' && head[3] >= '1' && head[3] <= '9')
    return Packing::Bzip2;
  if (head[0] == 0x1F && head[1] == 0x8B) return Packing::Gzip;
  if (head[0] == 0x28 && head[1] == 0xB5 && head[2] == 0x2F && head[3] == 0xFD) return Packing::Zstd;
  return Packing::None;
}

UnpackedBytes unpack_bytes(Packing packing, ByteSpan packed, std::uint64_t max) {
  UnpackedBytes out;
  if (packing == Packing::None) {
    out.bytes.assign(packed.begin(), packed.end());
    return out;
  }
  const auto unpacker = Unpacker::make(packing);
  const auto sink = [&](ByteSpan piece) -> Status {
    if (piece.size() > max - out.bytes.size()) return tl::unexpected(too_much(max));
    append(out.bytes, piece);
    return {};
  };
  if (Status status = (*unpacker)->give(packed, sink); !status) {
    out.damage = status.error();
  } else if (!(*unpacker)->complete()) {
    out.damage = Error{ErrorCode::Unreadable, fmt::format("truncated {} stream", to_string(packing)), {}, {}};
  }
  return out;
}

Result<UnpackedFile> unpack_file(const ByteSource& packed, Packing packing, const UnpackLimits& limits) {
  auto unpacker = Unpacker::make(packing);
  if (!unpacker) return tl::unexpected(unpacker.error());
  const Result<std::uint64_t> size = packed.size();
  if (!size) return tl::unexpected(size.error());
  auto file = TemporaryFile::create();
  if (!file) return tl::unexpected(file.error());

  BoundedFile bounded(*file, *size, limits);
  const auto sink = [&](ByteSpan piece) { return bounded.take(piece); };
  UnpackedFile out;
  Bytes piece(kPiece);
  for (std::uint64_t at = 0; at < *size && !out.damage;) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, *size - at)));
    Status status = packed.read(at, piece);
    if (status) status = (*unpacker)->give(piece, sink);
    if (bounded.refusal) {
      bounded.refusal->place.source = packed.name();
      return tl::unexpected(*bounded.refusal);
    }
    if (!status) {
      out.damage = status.error();
      out.damage->place = {.source = packed.name(), .byte = static_cast<std::int64_t>(at)};
    }
    at += piece.size();
  }
  if (!out.damage && !(*unpacker)->complete())
    out.damage = Error{ErrorCode::Unreadable,
                       fmt::format("truncated {} stream", to_string(packing)),
                       {.source = packed.name(), .byte = static_cast<std::int64_t>(*size)},
                       "Data before the truncation are read."};
  out.source = std::make_unique<UnpackedSource>(std::move(*file), packed.name());
  return out;
}

std::shared_ptr<const TemporaryFile> unpacked_to(const ByteSource& source) {
  const auto* unpacked = dynamic_cast<const UnpackedSource*>(&source);
  return unpacked == nullptr ? nullptr : unpacked->file();
}

namespace {

tl::unexpected<Error> damaged(Packing packing, std::string_view why) {
  return fail(ErrorCode::Unreadable, fmt::format("damaged {} stream ({})", to_string(packing), why));
}

struct Bzlib {
  using Stream = bz_stream;
  using Byte = char;
  static constexpr Packing kPacking = Packing::Bzip2;
  static constexpr const char* kName = "bzlib";
  static bool begin(Stream& stream) { return BZ2_bzDecompressInit(&stream, 0, 0) == BZ_OK; }
  static int step(Stream& stream) { return BZ2_bzDecompress(&stream); }
  static bool sound(int code) { return code == BZ_OK || code == BZ_STREAM_END; }
  static bool at_end(int code) { return code == BZ_STREAM_END; }
  static void end(Stream& stream) { BZ2_bzDecompressEnd(&stream); }
};

struct Zlib {
  using Stream = z_stream;
  using Byte = Bytef;
  static constexpr Packing kPacking = Packing::Gzip;
  static constexpr const char* kName = "zlib";
  static bool begin(Stream& stream) {
    constexpr int kGzipOnly = 16 + MAX_WBITS;
    return inflateInit2(&stream, kGzipOnly) == Z_OK;
  }
  static int step(Stream& stream) { return inflate(&stream, Z_NO_FLUSH); }
  static bool sound(int code) { return code == Z_OK || code == Z_STREAM_END || code == Z_BUF_ERROR; }
  static bool at_end(int code) { return code == Z_STREAM_END; }
  static void end(Stream& stream) { inflateEnd(&stream); }
};

/// Unpacks using a library with zlib's interface. Streams may be concatenated.
template <class Library>
class StreamUnpacker final : public Unpacker {
 public:
  StreamUnpacker() = default;
  ~StreamUnpacker() override {
    if (open_) Library::end(stream_);
  }

  Status give(ByteSpan packed, const Sink& sink) override {
    // The libraries do not write to their input.
    stream_.next_in = reinterpret_cast<typename Library::Byte*>(  // NOLINT(*-reinterpret-cast)
        const_cast<std::uint8_t*>(packed.data()));                // NOLINT(*-const-cast)
    stream_.avail_in = static_cast<unsigned>(packed.size());
    bool more_output = false;
    while (stream_.avail_in > 0 || more_output) {
      if (!open_ && !open()) return damaged(Library::kPacking, "out of memory");
      stream_.next_out = out_.data();
      stream_.avail_out = kPiece;
      const int code = Library::step(stream_);
      if (!Library::sound(code))
        return damaged(Library::kPacking, fmt::format("{} code {}", Library::kName, code));
      more_output = stream_.avail_out == 0;
      const std::size_t got = kPiece - stream_.avail_out;
      if (Status status = sink(ByteSpan(reinterpret_cast<const std::uint8_t*>(out_.data()), got)); !status)
        return status;
      if (Library::at_end(code)) {
        open_ = more_output = false;
        Library::end(stream_);
      }
    }
    return {};
  }
  bool complete() const override { return !open_; }

 private:
  /// Opens the next stream at the end of the previous one.
  bool open() {
    typename Library::Stream fresh{};
    fresh.next_in = stream_.next_in;
    fresh.avail_in = stream_.avail_in;
    stream_ = fresh;
    open_ = Library::begin(stream_);
    return open_;
  }

  typename Library::Stream stream_{};
  bool open_ = false;
  std::array<typename Library::Byte, kPiece> out_{};
};

class ZstdUnpacker final : public Unpacker {
 public:
  ZstdUnpacker() { ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, kMaxWindowLog); }

  Status give(ByteSpan packed, const Sink& sink) override {
    ZSTD_inBuffer in{packed.data(), packed.size(), 0};
    bool more_output = false;
    while (in.pos < in.size || more_output) {
      ZSTD_outBuffer out{out_.data(), out_.size(), 0};
      const std::size_t hint = ZSTD_decompressStream(context_.get(), &out, &in);
      if (ZSTD_isError(hint) != 0) return damaged(Packing::Zstd, ZSTD_getErrorName(hint));
      complete_ = hint == 0;
      more_output = out.pos == out.size;
      if (Status status = sink(ByteSpan(out_.data(), out.pos)); !status) return status;
      if (complete_ && in.pos == in.size) break;
    }
    return {};
  }
  bool complete() const override { return complete_; }

 private:
  static constexpr int kMaxWindowLog = 27;  // 128 MiB, the limit of the zstd command line tool
  std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context_{ZSTD_createDCtx(), ZSTD_freeDCtx};
  std::array<std::uint8_t, kPiece> out_{};
  bool complete_ = true;
};

class Lz4Unpacker final : public Unpacker {
 public:
  Lz4Unpacker() {
    LZ4F_dctx* raw = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) == 0) context_.reset(raw);
  }

  Status give(ByteSpan packed, const Sink& sink) override {
    if (!context_) return damaged(Packing::Lz4, "out of memory");
    bool more_output = false;
    while (!packed.empty() || more_output) {
      std::size_t in = packed.size();
      std::size_t out = out_.size();
      const std::size_t hint =
          LZ4F_decompress(context_.get(), out_.data(), &out, packed.data(), &in, nullptr);
      if (LZ4F_isError(hint) != 0) return damaged(Packing::Lz4, LZ4F_getErrorName(hint));
      complete_ = hint == 0;
      more_output = out == out_.size() && !complete_;
      packed = packed.subspan(in);
      if (Status status = sink(ByteSpan(out_.data(), out)); !status) return status;
      if (in == 0 && out == 0) break;
    }
    return {};
  }
  bool complete() const override { return complete_; }

 private:
  std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context_{nullptr,
                                                                        LZ4F_freeDecompressionContext};
  std::array<std::uint8_t, kPiece> out_{};
  bool complete_ = true;
};

}  // namespace

Result<std::unique_ptr<Unpacker>> Unpacker::make(Packing packing) {
  switch (packing) {
    case Packing::Bzip2:
      return std::make_unique<StreamUnpacker<Bzlib>>();
    case Packing::Gzip:
      return std::make_unique<StreamUnpacker<Zlib>>();
    case Packing::Zstd:
      return std::make_unique<ZstdUnpacker>();
    case Packing::Lz4:
      return std::make_unique<Lz4Unpacker>();
    case Packing::None:
      break;
  }
  return fail(ErrorCode::InvalidArgument, "not compressed");
}

}  // namespace waymark
