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
  UnpackedSource(std::shared_ptr<TemporaryFile> file, std::unique_ptr<ByteSource> bytes, std::string name)
      : file_(std::move(file)), bytes_(std::move(bytes)), name_(std::move(name)) {}
  Result<std::uint64_t> size() const override { return bytes_->size(); }
  Status read(std::uint64_t offset, std::span<std::uint8_t> out) const override {
    Status status = bytes_->read(offset, out);
    if (!status) status.error().place.source = name_;
    return status;
  }
  std::string name() const override { return name_; }
  std::string path() const { return file_->path().string(); }

 private:
  std::shared_ptr<TemporaryFile> file_;
  std::unique_ptr<ByteSource> bytes_;
  std::string name_;
};

Error too_much(std::uint64_t max) {
  return {ErrorCode::LimitExceeded, fmt::format("unpacks to more than {} bytes", max), {}, {}};
}

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

Result<UnpackedFile> unpack_file(const ByteSource& packed, Packing packing, std::uint64_t max) {
  auto unpacker = Unpacker::make(packing);
  if (!unpacker) return tl::unexpected(unpacker.error());
  const Result<std::uint64_t> size = packed.size();
  if (!size) return tl::unexpected(size.error());
  auto file = TemporaryFile::create();
  if (!file) return tl::unexpected(file.error());

  std::optional<Error> full;  // of our own making: no damage
  const auto sink = [&](ByteSpan piece) -> Status {
    Status status =
        piece.size() > max - (*file)->size() ? Status(tl::unexpected(too_much(max))) : (*file)->append(piece);
    if (!status) full = status.error();
    return status;
  };
  UnpackedFile out;
  Bytes piece(kPiece);
  for (std::uint64_t at = 0; at < *size && !out.damage;) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, *size - at)));
    Status status = packed.read(at, piece);
    if (status) status = (*unpacker)->give(piece, sink);
    if (full) {
      full->place.source = packed.name();
      if (full->hint.empty()) full->hint = "Unpack it by hand if it is meant to be that large.";
      return tl::unexpected(*full);
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
  auto bytes = open_file((*file)->path());
  if (!bytes) return tl::unexpected(bytes.error());
  out.source = std::make_unique<UnpackedSource>(std::move(*file), std::move(*bytes), packed.name());
  return out;
}

std::optional<std::string> unpacked_path(const ByteSource& source) {
  if (const auto* unpacked = dynamic_cast<const UnpackedSource*>(&source)) return unpacked->path();
  return std::nullopt;
}

}  // namespace waymark
