// Round trips and damage of compressed bytes, both in MCAP chunks and in files compressed as a whole.
#include "waymark/recording/compression.hpp"

#include <bzlib.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

constexpr Compression kCompressions[] = {Compression::None, Compression::Lz4, Compression::Zstd};

/// Half repetitive, half noise.
Bytes some_bytes(std::size_t size, std::uint64_t seed = 3) {
  Random random(seed);
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i)
    bytes[i] = static_cast<std::uint8_t>((i / 64) % 2 == 0 ? i % 7 : random.index(256));
  return bytes;
}

TEST(Compression, RoundTripsAndChecksTheSize) {
  for (const Compression how : kCompressions) {
    EXPECT_EQ(parse_compression(to_string(how)).value(), how);
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1000}, std::size_t{300'000}}) {
      const Bytes bytes = some_bytes(size);
      Bytes packed;
      ASSERT_TRUE(compress(how, bytes, packed));
      Bytes room;
      const auto back = decompress(how, packed, size, room);
      ASSERT_TRUE(back) << to_string(how) << " " << size << ": " << to_string(back.error());
      EXPECT_TRUE(std::ranges::equal(*back, bytes)) << to_string(how) << " " << size;
      EXPECT_FALSE(decompress(how, packed, size + 1, room))
          << to_string(how) << ": smaller than the given size";
      if (size > 0)
        EXPECT_FALSE(decompress(how, packed, size - 1, room))
            << to_string(how) << ": larger than the given size";
    }
  }
  EXPECT_FALSE(parse_compression("rar"));
}

TEST(Compression, AppendsAndReusesTheBuffer) {
  for (const Compression how : kCompressions) {
    Bytes packed = {1, 2, 3};
    ASSERT_TRUE(compress(how, some_bytes(500), packed));
    EXPECT_EQ(Bytes(packed.begin(), packed.begin() + 3), (Bytes{1, 2, 3}));
    Bytes room = some_bytes(10'000, 9);
    const auto back = decompress(how, ByteSpan(packed).subspan(3), 500, room);
    ASSERT_TRUE(back);
    EXPECT_TRUE(std::ranges::equal(*back, some_bytes(500)));
  }
}

TEST(Compression, EveryTruncationFailsAndDamageDoesNotCrash) {
  const Bytes bytes = some_bytes(2000);
  for (const Compression how : {Compression::Lz4, Compression::Zstd}) {
    Bytes packed;
    ASSERT_TRUE(compress(how, bytes, packed));
    Bytes room;
    for (std::size_t size = 0; size < packed.size(); ++size)
      EXPECT_FALSE(decompress(how, ByteSpan(packed).first(size), bytes.size(), room)) << size;
    Random random(5);
    for (int i = 0; i < 500; ++i) {
      Bytes damaged = packed;
      damaged[random.index(damaged.size())] ^= static_cast<std::uint8_t>(1 + random.index(255));
      const auto back = decompress(how, damaged, bytes.size(), room);
      if (back) EXPECT_EQ(back->size(), bytes.size());
    }
  }
}

TEST(Crc32, MatchesTheStandardAndCombinesParts) {
  EXPECT_EQ(crc32(as_bytes("123456789")), 0xCBF43926U);  // the check value of CRC-32/ISO-HDLC
  EXPECT_EQ(crc32({}), 0U);
  const Bytes bytes = some_bytes(5000);
  for (const std::size_t cut :
       {std::size_t{0}, std::size_t{1}, std::size_t{63}, std::size_t{4096}, bytes.size()}) {
    const ByteSpan first = ByteSpan(bytes).first(cut);
    const ByteSpan second = ByteSpan(bytes).subspan(cut);
    EXPECT_EQ(crc32(second, crc32(first)), crc32(bytes)) << cut;
    EXPECT_EQ(crc32_of_both(crc32(first), crc32(second), second.size()), crc32(bytes)) << cut;
  }
}

Bytes gzip(ByteSpan bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  Bytes packed(deflateBound(&stream, bytes.size()) + 64);
  stream.next_in = const_cast<std::uint8_t*>(bytes.data());  // NOLINT: zlib does not write there
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

Bytes bzip2(ByteSpan bytes) {
  Bytes packed(bytes.size() + bytes.size() / 100 + 600);
  auto size = static_cast<unsigned>(packed.size());
  // NOLINTNEXTLINE: libbz2 does not write to its source
  auto* source = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));
  EXPECT_EQ(BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(packed.data()), &size, source,
                                     static_cast<unsigned>(bytes.size()), 9, 0, 0),
            BZ_OK);
  packed.resize(size);
  return packed;
}

struct Packed {
  Packing packing;
  Bytes bytes;
};

std::vector<Packed> packed_with_all(const Bytes& bytes) {
  Bytes zstd;
  EXPECT_TRUE(compress(Compression::Zstd, bytes, zstd));
  return {{Packing::Gzip, gzip(bytes)}, {Packing::Bzip2, bzip2(bytes)}, {Packing::Zstd, zstd}};
}

TEST(Unpacker, RecognisesTheFormatByItsFirstBytesAndRoundTrips) {
  const Bytes bytes = some_bytes(100'000);
  for (const auto& [packing, packed] : packed_with_all(bytes)) {
    EXPECT_EQ(packing_of(packed), packing);
    const UnpackedBytes back = unpack_bytes(packing, packed, bytes.size());
    EXPECT_FALSE(back.damage) << to_string(packing) << ": " << to_string(*back.damage);
    EXPECT_EQ(back.bytes, bytes) << to_string(packing);
  }
  EXPECT_EQ(packing_of(as_bytes("t_s,landmark")), Packing::None);
  EXPECT_EQ(packing_of({}), Packing::None);
  EXPECT_EQ(packing_of(as_bytes("B")), Packing::None);
}

TEST(Unpacker, AcceptsBlocksOfAnySizeAndConcatenatedStreams) {
  const Bytes bytes = some_bytes(5000);
  Bytes twice = bytes;
  append(twice, bytes);
  for (const auto& [packing, packed] : packed_with_all(bytes)) {
    Bytes both = packed;
    append(both, packed);
    for (const std::size_t piece : {std::size_t{1}, std::size_t{17}, both.size()}) {
      auto unpacker = Unpacker::make(packing);
      ASSERT_TRUE(unpacker);
      Bytes out;
      for (std::size_t at = 0; at < both.size(); at += piece) {
        const Status given = (*unpacker)->give(ByteSpan(both).subspan(at, std::min(piece, both.size() - at)),
                                               [&](ByteSpan part) {
                                                 append(out, part);
                                                 return Status();
                                               });
        ASSERT_TRUE(given) << to_string(packing) << ": " << to_string(given.error());
      }
      EXPECT_TRUE((*unpacker)->complete()) << to_string(packing);
      EXPECT_EQ(out, twice) << to_string(packing) << " in blocks of " << piece;
    }
  }
}

TEST(Unpacker, KeepsBytesBeforeATruncationAndReportsIt) {
  const Bytes bytes = some_bytes(400'000);
  for (const auto& [packing, packed] : packed_with_all(bytes)) {
    const UnpackedBytes half = unpack_bytes(packing, ByteSpan(packed).first(packed.size() - 5), bytes.size());
    ASSERT_TRUE(half.damage) << to_string(packing);
    ASSERT_LE(half.bytes.size(), bytes.size());
    EXPECT_TRUE(std::equal(half.bytes.begin(), half.bytes.end(), bytes.begin())) << to_string(packing);
    const UnpackedBytes limited = unpack_bytes(packing, packed, 1000);
    ASSERT_TRUE(limited.damage);
    EXPECT_EQ(limited.damage->code, ErrorCode::LimitExceeded);
    EXPECT_LE(limited.bytes.size(), 1000U);
  }
}

TEST(Unpacker, StopsOnASinkErrorAndSurvivesDamage) {
  const Bytes bytes = some_bytes(50'000);
  Random random(11);
  for (const auto& [packing, packed] : packed_with_all(bytes)) {
    auto unpacker = Unpacker::make(packing);
    ASSERT_TRUE(unpacker);
    const Status full =
        (*unpacker)->give(packed, [](ByteSpan) -> Status { return fail(ErrorCode::Unwritable, "no room"); });
    ASSERT_FALSE(full);
    EXPECT_EQ(full.error().message, "no room") << to_string(packing);
    int noticed = 0;
    for (int i = 0; i < 40; ++i) {
      Bytes damaged = packed;
      damaged[10 + random.index(damaged.size() - 10)] ^= static_cast<std::uint8_t>(1 + random.index(255));
      const UnpackedBytes back = unpack_bytes(packing, damaged, 2 * bytes.size());
      noticed += back.damage || back.bytes != bytes ? 1 : 0;
    }
    EXPECT_GT(noticed, 30) << to_string(packing);
  }
}

TEST(UnpackFile, ReadsLikeAnUncompressedFile) {
  const Bytes bytes = some_bytes(70'000);
  for (const auto& [packing, packed] : packed_with_all(bytes)) {
    const auto source = memory_source(packed, "lap.packed");
    auto file = unpack_file(*source, packing, {});
    ASSERT_TRUE(file) << to_string(file.error());
    EXPECT_FALSE(file->damage);
    ASSERT_EQ(file->source->size().value(), bytes.size());
    Bytes part(100);
    ASSERT_TRUE(file->source->read(69'900, part));
    EXPECT_TRUE(std::equal(part.begin(), part.end(), bytes.end() - 100));
    EXPECT_FALSE(file->source->read(69'901, part)) << "past the end";
    EXPECT_NE(unpacked_to(*file->source), nullptr);
    EXPECT_EQ(unpacked_to(*source), nullptr);
  }
}

/// Compressed zeros, 1 MiB per block.
Bytes packed_zeros(int mebibytes) {
  const Bytes zeros(std::size_t{1} << 20, 0);
  Bytes part;
  Bytes packed;
  EXPECT_TRUE(compress(Compression::Zstd, zeros, part));
  for (int i = 0; i < mebibytes; ++i) append(packed, part);
  return packed;
}

TEST(Unpack, EnforcesLimitsOfRatioDiskSpaceAndTime) {
  const Bytes packed = packed_zeros(64);
  int calls = 0;
  const auto error_of = [&](UnpackLimits limits) {
    const auto log = open_log(memory_source(packed), {.unpack = std::move(limits)});
    EXPECT_FALSE(log);
    const Error error = log ? Error{} : log.error();
    testing::expect_on_page("recording", error);
    return error.code;
  };
  EXPECT_EQ(error_of({}), ErrorCode::Unsupported) << "unpacked, but not a recording";
  EXPECT_EQ(error_of({.max_ratio = 100, .any_ratio_bytes = 1 << 20}), ErrorCode::LimitExceeded);
  EXPECT_EQ(error_of({.keep_free_bytes = UINT64_MAX}), ErrorCode::LimitExceeded);
  EXPECT_EQ(error_of({.stop = [&] { return ++calls > 10; }}), ErrorCode::LimitExceeded);
  EXPECT_EQ(calls, 11) << "unpacking stops there";
}

TEST(Unpack, AllowedSizeGrowsWithTheFileUpToTheLimit) {
  const UnpackLimits limits{.max_bytes = 10'000, .max_ratio = 10, .any_ratio_bytes = 500};
  EXPECT_EQ(limits.max_unpacked_bytes(1), 500U);
  EXPECT_EQ(limits.max_unpacked_bytes(100), 1000U);
  EXPECT_EQ(limits.max_unpacked_bytes(5000), 10'000U);
  EXPECT_EQ(limits.max_unpacked_bytes(UINT64_MAX), 10'000U);
}

// 64 MiB of zeros compress to a few kilobytes.
TEST(Unpack, StopsADecompressionBombAtTheLimit) {
  Bytes packed;
  for (int i = 0; i < 4; ++i) {
    const Bytes zeros(std::size_t{1} << 24, 0);
    Bytes part;
    ASSERT_TRUE(compress(Compression::Zstd, zeros, part));
    append(packed, part);
  }
  EXPECT_LT(packed.size(), 20'000U);
  const UnpackedBytes some = unpack_bytes(Packing::Zstd, packed, 1 << 20);
  ASSERT_TRUE(some.damage);
  EXPECT_EQ(some.damage->code, ErrorCode::LimitExceeded);
  EXPECT_LE(some.bytes.size(), std::size_t{1} << 20);
  const auto log = open_log(memory_source(packed), {.unpack = {.max_bytes = 1 << 20}});
  ASSERT_FALSE(log);
  EXPECT_EQ(log.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(unpack_bytes(Packing::Zstd, packed, 1 << 27).bytes.size(), std::size_t{4} << 24);
}

}  // namespace
}  // namespace waymark
