#include <array>

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "waymark/recording/unpack.hpp"

namespace waymark {
namespace {

constexpr std::size_t kPiece = 1 << 16;

tl::unexpected<Error> damaged(Packing packing, std::string_view why) {
  return fail(ErrorCode::Unreadable, fmt::format("the {} packing is damaged ({})", to_string(packing), why));
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

/// By a library with zlib's interface. Where a stream ends another may follow.
template <class Library>
class StreamUnpacker final : public Unpacker {
 public:
  StreamUnpacker() = default;
  ~StreamUnpacker() override {
    if (open_) Library::end(stream_);
  }

  Status give(ByteSpan packed, const Sink& sink) override {
    // The libraries promise not to write to their input.
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
  /// A new stream that reads on where the last one ended.
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
  static constexpr int kMaxWindowLog = 27;  // 128 MiB, as the command line tool allows
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
  return fail(ErrorCode::InvalidArgument, "these bytes are not packed");
}

}  // namespace waymark
