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

class Bzip2Unpacker final : public Unpacker {
 public:
  ~Bzip2Unpacker() override {
    if (open_) BZ2_bzDecompressEnd(&stream_);
  }
  Bzip2Unpacker() = default;

  Status give(ByteSpan packed, const Sink& sink) override {
    // bzlib promises not to write to its input.
    stream_.next_in =
        const_cast<char*>(as_text(packed).data());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    stream_.avail_in = static_cast<unsigned>(packed.size());
    bool more_output = false;
    while (stream_.avail_in > 0 || more_output) {
      if (!open_) {
        char* in = stream_.next_in;
        const unsigned left = stream_.avail_in;
        stream_ = {};
        if (BZ2_bzDecompressInit(&stream_, 0, 0) != BZ_OK) return damaged(Packing::Bzip2, "out of memory");
        stream_.next_in = in;
        stream_.avail_in = left;
        open_ = true;
      }
      stream_.next_out = out_.data();
      stream_.avail_out = kPiece;
      const int code = BZ2_bzDecompress(&stream_);
      if (code != BZ_OK && code != BZ_STREAM_END)
        return damaged(Packing::Bzip2, fmt::format("bzlib code {}", code));
      more_output = stream_.avail_out == 0;
      const std::string_view got(out_.data(), kPiece - stream_.avail_out);
      if (Status status = sink(as_bytes(got)); !status) return status;
      if (code == BZ_STREAM_END) {
        open_ = more_output = false;
        BZ2_bzDecompressEnd(&stream_);
      }
    }
    return {};
  }
  bool complete() const override { return !open_; }

 private:
  bz_stream stream_{};
  bool open_ = false;
  std::array<char, kPiece> out_{};
};

class GzipUnpacker final : public Unpacker {
 public:
  GzipUnpacker() = default;
  ~GzipUnpacker() override {
    if (open_) inflateEnd(&stream_);
  }

  Status give(ByteSpan packed, const Sink& sink) override {
    stream_.next_in = const_cast<Bytef*>(packed.data());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    stream_.avail_in = static_cast<uInt>(packed.size());
    bool more_output = false;
    while (stream_.avail_in > 0 || more_output) {
      if (!open_) {
        Bytef* in = stream_.next_in;
        const uInt left = stream_.avail_in;
        stream_ = {};
        constexpr int kGzipOnly = 16 + MAX_WBITS;
        if (inflateInit2(&stream_, kGzipOnly) != Z_OK) return damaged(Packing::Gzip, "out of memory");
        stream_.next_in = in;
        stream_.avail_in = left;
        open_ = true;
      }
      stream_.next_out = out_.data();
      stream_.avail_out = kPiece;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR)
        return damaged(Packing::Gzip, fmt::format("zlib code {}", code));
      more_output = stream_.avail_out == 0;
      const std::size_t got = kPiece - stream_.avail_out;
      if (Status status = sink(ByteSpan(out_.data(), got)); !status) return status;
      if (code == Z_STREAM_END) {
        open_ = more_output = false;
        inflateEnd(&stream_);
      }
    }
    return {};
  }
  bool complete() const override { return !open_; }

 private:
  z_stream stream_{};
  bool open_ = false;
  std::array<Bytef, kPiece> out_{};
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
      return std::make_unique<Bzip2Unpacker>();
    case Packing::Gzip:
      return std::make_unique<GzipUnpacker>();
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
