// The doors behind open_log() that need no other program: definitions, packing, events and tables in memory.
// What other programs write is held against them in tests/recording.
#include "waymark/recording/message_log.hpp"

#include <filesystem>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/export_log.hpp"
#include "waymark/recording/mcap/writer.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

std::unique_ptr<MessageLog> opened(std::string_view bytes, const LogOptions& options = {}) {
  auto log = open_log(memory_source(as_bytes(bytes), "memory"), options);
  EXPECT_TRUE(log) << to_string(log.error());
  return log ? std::move(*log) : nullptr;
}

std::vector<Sample> samples_of(MessageLog& log, const LogSelection& selection = {}) {
  std::vector<Sample> samples;
  const Status status = log.visit_samples(selection, [&](const Sample& sample) {
    samples.push_back(sample);
    return Status{};
  });
  EXPECT_TRUE(status) << to_string(status.error());
  return samples;
}

constexpr std::string_view kHeader =
    "================================================================================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

TEST(RosDefinition, KeepsWhatRos2SaysTheSameWay) {
  const std::string text =
      "# words\nHeader header\nint32 A=5 # of course\nstring B= x # y\nfloat64[3] v\nuint8[] data\nduration "
      "d\nbyte b\n" +
      std::string(kHeader);
  const auto transcoder = ros::Ros1Transcoder::make("pkg_msgs/Type", text);
  ASSERT_TRUE(transcoder) << to_string(transcoder.error());
  EXPECT_EQ(transcoder->type(), "pkg_msgs/msg/Type");
  const std::string& schema = transcoder->schema();
  EXPECT_TRUE(
      schema.starts_with("int32 A=5\nstring B=\"x # y\"\nstd_msgs/Header header\nfloat64[3] v\nuint8[] data\n"
                         "builtin_interfaces/Duration d\nint8 b\n"))
      << schema;
  EXPECT_EQ(schema.find("seq"), std::string::npos);
  EXPECT_NE(schema.find("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"), std::string::npos);
}

TEST(RosDefinition, RefusesWhatMakesNoSense) {
  for (const char* text : {"Foo foo\n", "uint8[x] a\n", "uint8[3 a\n", "uint8\n", "uint8[99999999999] a\n"}) {
    const auto parsed = ros::parse_definition("pkg/Type", text);
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().place.line, 1) << text;
  }
  const auto recursive = ros::parse_definition(
      "pkg/Type", "A a\n====================\nMSG: pkg/A\nB b\n====================\nMSG: pkg/B\nA a\n");
  ASSERT_FALSE(recursive);
  EXPECT_NE(recursive.error().message.find("uses itself"), std::string::npos);
}

TEST(Ros1Transcoder, PadsAsCdrWants) {
  const auto transcoder = ros::Ros1Transcoder::make(
      "pkg/Type", "uint8 a\nfloat64 b\nstring s\nint16[] c\nfloat64[] none\nbool e\n");
  ASSERT_TRUE(transcoder);
  const Bytes ros1 = {7,   0, 0, 0, 0, 0, 0, 0xF0, 0x3F, 2, 0, 0, 0, 'h',
                      'i', 2, 0, 0, 0, 1, 0, 2,    0,    0, 0, 0, 0, 1};
  Bytes cdr;
  ASSERT_TRUE(transcoder->transcode(ros1, cdr));
  const Bytes expected = {0, 1, 0, 0,   7,   0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F, 3,
                          0, 0, 0, 'h', 'i', 0, 0, 2, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0,    1};
  EXPECT_EQ(cdr, expected);
  for (std::size_t size = 0; size < ros1.size(); ++size) {
    Bytes out;
    EXPECT_FALSE(transcoder->transcode(ByteSpan(ros1).first(size), out)) << size;
  }
  Bytes longer = ros1;
  longer.push_back(0);
  EXPECT_FALSE(transcoder->transcode(longer, cdr));
}

// Structs of nothing, repeated without end, take no input: they must not make any output without end either.
TEST(Ros1Transcoder, NothingRepeatedEndsSoon) {
  std::string text = "A[10000000] a\n";
  for (const char* name : {"A", "B", "C"})
    text += std::string("====================\nMSG: pkg/") + name + "\n" +
            (*name == 'C' ? "int8[0] z\n" : std::string(1, static_cast<char>(*name + 1)) + "[10000000] x\n");
  const auto transcoder = ros::Ros1Transcoder::make("pkg/Type", text);
  ASSERT_TRUE(transcoder) << to_string(transcoder.error());
  Bytes cdr;
  EXPECT_FALSE(transcoder->transcode({}, cdr));
  EXPECT_LT(cdr.size(), std::size_t{1} << 20);
}

TEST(Ros1Transcoder, KnownTypesGetTheNamesOfRos2) {
  const auto info = ros::Ros1Transcoder::make(
      "sensor_msgs/CameraInfo",
      "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] "
      "K\nfloat64[9] R\n"
      "float64[12] P\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n" +
          std::string(kHeader) +
          "================================================================================\nMSG: "
          "sensor_msgs/RegionOfInterest\n"
          "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n");
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_TRUE(info->same_as_ros2());
  EXPECT_EQ(info->schema(), ros2::schema_text(ros2::CameraInfo::kType));
  const auto other = ros::Ros1Transcoder::make("nav_msgs/Odometry", "float64 x\n");
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->same_as_ros2());
}

/// Zeros, packed; a MiB each time.
Bytes packed_zeros(int mebibytes) {
  const Bytes zeros(std::size_t{1} << 20, 0);
  Bytes part;
  Bytes packed;
  EXPECT_TRUE(compress(Compression::Zstd, zeros, part));
  for (int i = 0; i < mebibytes; ++i) append(packed, part);
  return packed;
}

std::string why_not(const Bytes& packed, UnpackLimits limits) {
  const auto log = open_log(memory_source(packed), {.unpack = std::move(limits)});
  return log ? "opened" : to_string(log.error());
}

TEST(Unpack, LimitsOfRatioDiskAndTimeHold) {
  const Bytes packed = packed_zeros(64);
  EXPECT_NE(why_not(packed, {}).find("no recording"), std::string::npos);
  EXPECT_NE(why_not(packed, {.max_ratio = 100, .any_ratio_bytes = 1 << 20}).find("unpacks to more than"),
            std::string::npos);
  EXPECT_NE(why_not(packed, {.keep_free_bytes = UINT64_MAX}).find("free on the disk"), std::string::npos);
  int asked = 0;
  EXPECT_NE(why_not(packed, {.stop = [&] { return ++asked > 10; }}).find("stopped"), std::string::npos);
  EXPECT_EQ(asked, 11) << "nothing is unpacked after that";
}

TEST(Unpack, TheMostGrowsWithTheFileUpToTheLimit) {
  const UnpackLimits limits{.max_bytes = 10'000, .max_ratio = 10, .any_ratio_bytes = 500};
  EXPECT_EQ(limits.most(1), 500U);
  EXPECT_EQ(limits.most(100), 1000U);
  EXPECT_EQ(limits.most(5000), 10'000U);
  EXPECT_EQ(limits.most(UINT64_MAX), 10'000U);
}

TEST(Unpack, TheTemporaryFileHasNoName) {
  const auto file = TemporaryFile::create();
  ASSERT_TRUE(file);
  const std::string link = "/proc/self/fd/" + std::to_string((*file)->descriptor());
  EXPECT_NE(std::filesystem::read_symlink(link).string().find("(deleted)"), std::string::npos);
}

TEST(OpenLog, APipeIsRefusedAtOnce) {
  const std::string name = ::testing::TempDir() + "waymark-log-pipe";
  (void)unlink(name.c_str());
  ASSERT_EQ(mkfifo(name.c_str(), 0600), 0);
  const auto log = open_log(std::filesystem::path(name));
  ASSERT_FALSE(log);
  EXPECT_NE(to_string(log.error()).find("pipe"), std::string::npos);
  (void)unlink(name.c_str());
}

// 64 MiB of zeros in a few kilobytes.
TEST(Unpack, ABombStopsAtTheLimit) {
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

TEST(MessageLog, SelectionIsByTopicAndTime) {
  const auto log = opened("t_s,landmark,range_m,bearing_rad\n1,1,1,0\n2,2,1,0\n3,3,1,0\n");
  ASSERT_TRUE(log);
  EXPECT_EQ(log->summary().start, 1'000'000'000U);
  EXPECT_EQ(log->summary().end, 3'000'000'000U);
  const auto some = samples_of(*log, {.from = 2'000'000'000, .to = 3'000'000'000});
  ASSERT_EQ(some.size(), 1U);
  EXPECT_EQ(std::get<RangeBearing>(some[0]).landmark, 2);
  EXPECT_TRUE(samples_of(*log, {.topics = {"/other"}}).empty());
}

TEST(MessageLog, TheVisitorsErrorEndsTheVisit) {
  const auto log = opened("t_s,landmark,range_m,bearing_rad\n1,1,1,0\n2,2,1,0\n");
  int visits = 0;
  const Status status = log->visit_samples({}, [&](const Sample&) -> Status {
    ++visits;
    return fail(ErrorCode::NotFound, "enough");
  });
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "enough");
  EXPECT_EQ(visits, 1);
}

TEST(ExportLog, WhatBecomesMcapComesBack) {
  const auto table = opened(
      "t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px\n"
      "1000,cam,tag36h11:7,10.5,20.5,30.5,20.5,30.5,40.5,10.5,40.5\n"
      "1000,left,tag25h9:3,1,2,3,2,3,4,1,4\n");
  Bytes file;
  const auto report = export_mcap(*table, memory_sink(file), {.metadata = {{"mine", {{"key", "value"}}}}});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->by_topic,
            (std::map<std::string, std::uint64_t>{{"/left/tag_detections", 1}, {"/tag_detections", 1}}));
  const auto log = opened(as_text(file));
  ASSERT_TRUE(log);
  EXPECT_EQ(log->format(), LogFormat::Mcap);
  EXPECT_EQ(log->setup()->metadata.at("mine").at("key"), "value");
  const auto samples = samples_of(*log);
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(std::get<TagFrame>(samples[1]).camera, "left");
  const auto& tag = std::get<TagFrame>(samples[0]).detections.at(0);
  EXPECT_EQ(to_string(tag.tag), "tag36h11:7");
  EXPECT_EQ(tag.corners_px[3], Eigen::Vector2d(10.5, 40.5));
}

/// A recording of one topic in ROS 1's encoding, as `mcap convert` leaves a bag.
Bytes ros1_mcap(std::uint64_t first_time, int count) {
  Bytes file;
  auto writer = mcap::Writer::open(memory_sink(file), {.profile = "ros1"});
  EXPECT_TRUE(writer);
  const std::string_view vector = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
  const std::string text = "Vector3 linear\nVector3 angular\n====================\n" + std::string(vector);
  const auto schema = writer->add_schema("geometry_msgs/Twist", "ros1msg", as_bytes(text));
  const auto channel = writer->add_channel("/cmd_vel", *schema, "ros1");
  for (int i = 0; i < count; ++i) {
    Bytes message;
    for (const double value : {0.5 * i, 0.0, 0.0, 0.0, 0.0, -1.0}) append_little_endian(message, value);
    const std::uint64_t time = first_time + static_cast<std::uint64_t>(i);
    EXPECT_TRUE(writer->write(*channel, time, time, message));
  }
  EXPECT_TRUE(writer->close());
  return file;
}

TEST(MessageLog, Ros1InsideMcapIsRewritten) {
  const Bytes file = ros1_mcap(5, 3);
  const auto log = opened(as_text(file));
  ASSERT_TRUE(log);
  EXPECT_EQ(log->channels().at(0).type, "geometry_msgs/msg/Twist");
  const auto samples = samples_of(*log);
  ASSERT_EQ(samples.size(), 3U);
  const auto& command = std::get<StampedCommand>(samples[2]);
  EXPECT_EQ(command.stamp.time_since_epoch().count(), 7);
  EXPECT_EQ(command.command, (VelocityCommand{1.0, -1.0}));
}

TEST(MessageLog, ASplitBagOfMcapFilesIsOne) {
  const std::filesystem::path folder = testing::fresh_folder("split_mcap");
  for (const auto& [name, first] : std::initializer_list<std::pair<const char*, int>>{
           {"b_0.mcap", 10}, {"b_1.mcap", 14}}) {  // they overlap by one
    const auto sink = create_file(folder / name);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(ros1_mcap(static_cast<std::uint64_t>(first), 5)));
  }
  for (const bool listed : {false, true}) {
    if (listed) {
      const auto sink = create_file(folder / "metadata.yaml");
      ASSERT_TRUE(
          (*sink)->write(as_bytes("rosbag2_bagfile_information:\n  storage_identifier: mcap\n"
                                  "  relative_file_paths:\n  - b_0.mcap\n  - b_1.mcap\n")));
    }
    auto log = open_log(folder);
    ASSERT_TRUE(log) << to_string(log.error());
    EXPECT_EQ((*log)->channels().size(), 1U);
    EXPECT_EQ((*log)->summary().messages, 10U);
    EXPECT_EQ((*log)->problems().empty(), listed);
    std::vector<std::int64_t> times;
    for (const Sample& sample : samples_of(**log))
      times.push_back(stamp_of(sample).time_since_epoch().count());
    EXPECT_EQ(times, (std::vector<std::int64_t>{10, 11, 12, 13, 14, 14, 15, 16, 17, 18}));
  }
}

TEST(MessageLog, ACopyInAFolderCountsOnceAndTwoDrivesAreNotOne) {
  const std::filesystem::path folder = testing::fresh_folder("copies_mcap");
  const auto write = [&](const char* name, ByteSpan bytes) {
    const auto sink = create_file(folder / name);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes));
  };
  const Bytes lap = ros1_mcap(10, 40);
  write("lap.mcap", lap);
  write("lap_copy.mcap", lap);
  write("lap_shorter.mcap", ros1_mcap(10, 30));  // the same messages, the last ones missing
  auto log = open_log(folder);
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(samples_of(**log).size(), 40U);
  std::vector<std::string> words;
  for (const LogProblem& problem : (*log)->problems()) words.push_back(to_string(problem.error));
  EXPECT_THAT(words, ::testing::Contains(::testing::HasSubstr("left out. Move the copy elsewhere")));
  Bytes other = ros1_mcap(11, 40);  // other words at these times
  write("other.mcap", other);
  log = open_log(folder);
  ASSERT_FALSE(log);
  EXPECT_THAT(to_string(log.error()), ::testing::HasSubstr("two recordings, and no parts of one"));
}

TEST(MessageLog, WhatIsNoRecordingSaysWhatIs) {
  for (const std::string_view bytes : {"", "hello",
                                       "\x7f"
                                       "ELF",
                                       "SQLite format 3"}) {
    const auto log = open_log(memory_source(as_bytes(bytes)), {});
    ASSERT_FALSE(log) << bytes;
    EXPECT_FALSE(log.error().message.empty());
  }
  EXPECT_EQ(open_log(std::filesystem::path("/no/such/file")).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace waymark
