#include "waymark/recording/byte_file.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/recording/byte_io.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

class ByteFile : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("byte_file");
  fs::path file_ = folder_ / "lap.mcap";

  void write(const fs::path& path, std::string_view text) const {
    auto sink = create_file(path);
    ASSERT_TRUE(sink) << to_string(sink.error());
    ASSERT_TRUE((*sink)->write(as_bytes(text)));
  }
  [[nodiscard]] std::string text_of(const fs::path& path) const {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

TEST_F(ByteFile, WrittenBytesAreReadableAtOnceAtAnyOffset) {
  auto sink = create_file(file_);
  ASSERT_TRUE(sink);
  auto source = open_file(file_);
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->size().value(), 0U);
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE((*sink)->write(as_bytes("0123456789")));
    EXPECT_EQ((*source)->size().value(), 10U * static_cast<unsigned>(i)) << "the file grows while it is read";
  }
  ASSERT_TRUE((*sink)->sync());
  Bytes part(4);
  ASSERT_TRUE((*source)->read(8, part));
  EXPECT_EQ(as_text(part), "8901");
  EXPECT_EQ((*source)->name(), file_.string());
  ASSERT_TRUE((*source)->read(30, {})) << "an empty read succeeds at any offset";
  const Status beyond = (*source)->read(28, part);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().place.source, file_.string());
  EXPECT_EQ(beyond.error().place.byte, 30) << "the end of the file";
}

TEST_F(ByteFile, NeverOverwritesAFile) {
  write(file_, "mine");
  const auto again = create_file(file_);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::Unwritable);
  testing::expect_on_page("recording", again.error());
  write(folder_ / "new", "new");
  const Status renamed = rename_to_new(folder_ / "new", file_);
  ASSERT_FALSE(renamed);
  EXPECT_EQ(renamed.error().place.source, file_.string());
  EXPECT_EQ(text_of(file_), "mine");
  EXPECT_EQ(text_of(folder_ / "new"), "new") << "the file keeps its old name";
  ASSERT_TRUE(rename_to_new(folder_ / "new", folder_ / "free"));
  EXPECT_EQ(text_of(folder_ / "free"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "new"));
  EXPECT_FALSE(rename_to_new(folder_ / "gone", folder_ / "other"));
  EXPECT_FALSE(fs::exists(folder_ / "other"));
}

TEST_F(ByteFile, MissingFilesAndFoldersAreDifferentErrors) {
  EXPECT_EQ(open_file(folder_ / "none").error().code, ErrorCode::NotFound);
  EXPECT_EQ(create_file(folder_ / "none" / "lap.mcap").error().code, ErrorCode::Unwritable);
  EXPECT_EQ(create_file(folder_).error().code, ErrorCode::Unwritable);
  const auto folder = open_file(folder_);
  Bytes byte(1);
  EXPECT_FALSE(folder && (*folder)->read(0, byte)) << "a folder cannot be read";
}

TEST_F(ByteFile, MemoryBehavesLikeAFile) {
  Bytes bytes;
  const auto sink = memory_sink(bytes);
  ASSERT_TRUE(sink->write(as_bytes("01234")));
  ASSERT_TRUE(sink->sync());
  const auto source = memory_source(bytes, "these");
  EXPECT_EQ(source->size().value(), 5U);
  Bytes part(2);
  ASSERT_TRUE(source->read(3, part));
  EXPECT_EQ(as_text(part), "34");
  for (const std::uint64_t offset : {std::uint64_t{4}, std::uint64_t{6}, UINT64_MAX}) {
    const Status beyond = source->read(offset, part);
    ASSERT_FALSE(beyond) << offset;
    EXPECT_EQ(beyond.error().place.source, "these");
  }
}

TEST(TemporaryFileTest, ContainsTheAppendedBytes) {
  const auto file = TemporaryFile::create();
  ASSERT_TRUE(file) << to_string(file.error());
  ASSERT_TRUE((*file)->append(as_bytes("hello ")));
  ASSERT_TRUE((*file)->append(as_bytes("world")));
  EXPECT_EQ((*file)->size(), 11U);
  Bytes part(5);
  ASSERT_TRUE((*file)->read(6, part));
  EXPECT_EQ(as_text(part), "world");
  EXPECT_FALSE((*file)->read(7, part));
  EXPECT_GT((*file)->free_bytes(), 0U);
}

TEST(BigEndianReader, AnExcessiveCountFailsBeforeAllocation) {
  const Bytes bytes = {0x01, 0x02, 0xC0, 0x45, 0, 0, 0, 0, 0, 0, 7};
  BigEndianReader reader(bytes);
  EXPECT_EQ(reader.number<std::uint16_t>(), 0x0102);
  EXPECT_EQ(reader.number<double>(), -42.0);
  std::vector<double> values;
  reader.numbers(values, std::uint64_t{1} << 60U);
  EXPECT_TRUE(reader.failed());
  EXPECT_TRUE(values.empty());
  EXPECT_EQ(reader.number<std::uint8_t>(), 0) << "a failed reader returns zeros";
}

TEST(TemporaryFileTest, HasNoName) {
  const auto file = TemporaryFile::create();
  ASSERT_TRUE(file);
  const std::string link = "/proc/self/fd/" + std::to_string((*file)->descriptor());
  EXPECT_NE(std::filesystem::read_symlink(link).string().find("(deleted)"), std::string::npos);
}

}  // namespace
}  // namespace waymark
