#include "waymark/recording/unpack.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/temporary_file.hpp"

namespace waymark {
namespace {

constexpr std::size_t kPiece = 1 << 16;

/// A file that was unpacked; keeps it on the disk as long as somebody reads.
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
          "Unpack it by hand if it is meant to be that large."};
}

/// Takes what was unpacked, as long as its limits allow.
class BoundedFile {
 public:
  BoundedFile(std::shared_ptr<TemporaryFile> file, std::uint64_t packed_bytes, const UnpackLimits& limits)
      : file_(std::move(file)), most_(limits.most(packed_bytes)), limits_(limits) {}

  Status take(ByteSpan piece) {
    if (piece.size() > most_ - file_->size()) return refused(too_much(most_));
    if (limits_.stop()) return refused({ErrorCode::LimitExceeded, "stopped while it was unpacked", {}, {}});
    if (file_->size() >= check_at_) {
      constexpr std::uint64_t kBetweenChecks = std::uint64_t{1} << 24U;
      check_at_ = file_->size() + kBetweenChecks;
      if (file_->free_bytes() < limits_.keep_free_bytes)
        return refused({ErrorCode::LimitExceeded,
                        fmt::format("unpacking it would leave less than {} bytes free on the disk of the "
                                    "temporary folder",
                                    limits_.keep_free_bytes),
                        {},
                        "Set TMPDIR to a folder with more room, or unpack it by hand."});
    }
    Status status = file_->append(piece);
    if (!status) refusal = status.error();
    return status;
  }

  std::optional<Error> refusal{};  ///< of our own making: no damage

 private:
  Status refused(Error error) {
    refusal = std::move(error);
    return tl::unexpected(*refusal);
  }

  std::shared_ptr<TemporaryFile> file_;
  std::uint64_t most_;
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
    out.damage = Error{
        ErrorCode::Unreadable, fmt::format("the {} packing ends too early", to_string(packing)), {}, {}};
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
                       fmt::format("the {} packing ends too early: the file was cut", to_string(packing)),
                       {.source = packed.name(), .byte = static_cast<std::int64_t>(*size)},
                       "What precedes the cut is read."};
  out.source = std::make_unique<UnpackedSource>(std::move(*file), packed.name());
  return out;
}

std::shared_ptr<const TemporaryFile> unpacked_to(const ByteSource& source) {
  const auto* unpacked = dynamic_cast<const UnpackedSource*>(&source);
  return unpacked == nullptr ? nullptr : unpacked->file();
}

}  // namespace waymark
