// Tests the parts of open_log() that need no other program: tables, MCAP and bag folders. Recordings of other
// programs are tested in tests/recording.
#include "waymark/recording/message_log.hpp"

#include <filesystem>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/export_log.hpp"
#include "waymark/recording/mcap/writer.hpp"

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

TEST(OpenLog, RejectsAPipeWithoutBlocking) {
  const std::string name = ::testing::TempDir() + "waymark-log-pipe";
  (void)unlink(name.c_str());
  ASSERT_EQ(mkfifo(name.c_str(), 0600), 0);
  const auto log = open_log(std::filesystem::path(name));
  ASSERT_FALSE(log);
  EXPECT_NE(to_string(log.error()).find("pipe"), std::string::npos);
  (void)unlink(name.c_str());
}

TEST(MessageLog, SelectsByTopicAndTime) {
  const auto log = opened("t_s,landmark,range_m,bearing_rad\n1,1,1,0\n2,2,1,0\n3,3,1,0\n");
  ASSERT_TRUE(log);
  EXPECT_EQ(log->summary().start, 1'000'000'000U);
  EXPECT_EQ(log->summary().end, 3'000'000'000U);
  const auto some = samples_of(*log, {.from = 2'000'000'000, .to = 3'000'000'000});
  ASSERT_EQ(some.size(), 1U);
  EXPECT_EQ(std::get<RangeBearing>(some[0]).landmark, 2);
  EXPECT_TRUE(samples_of(*log, {.topics = {"/other"}}).empty());
}

TEST(MessageLog, AVisitorErrorEndsTheVisit) {
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

TEST(ExportLog, McapRoundTrips) {
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

/// A recording of one topic in ROS 1 encoding, as `mcap convert` writes it from a bag.
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

TEST(MessageLog, ConvertsRos1InsideMcap) {
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

/// A recording of transforms in ROS 1 encoding with the old type: a robot that drives 1 m from odom's origin.
Bytes old_transforms(const std::string& topic = "/tf", std::string_view base = "/base_link") {
  Bytes file;
  auto writer = mcap::Writer::open(memory_sink(file), {.profile = "ros1"});
  EXPECT_TRUE(writer);
  const std::string text =
      "geometry_msgs/TransformStamped[] transforms\n====================\n"
      "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
      "geometry_msgs/Transform transform\n====================\n"
      "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n====================\n"
      "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
      "geometry_msgs/Quaternion rotation\n====================\n"
      "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n====================\n"
      "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
  const auto schema = writer->add_schema("tf/tfMessage", "ros1msg", as_bytes(text));
  const auto channel = writer->add_channel(topic, *schema, "ros1");
  const auto append_text = [](Bytes& out, std::string_view word) {
    append_little_endian(out, static_cast<std::uint32_t>(word.size()));
    append(out, as_bytes(word));
  };
  for (std::uint32_t i = 1; i <= 10; ++i) {
    Bytes message;
    for (const std::uint32_t value : {1U, i, i, 0U}) append_little_endian(message, value);  // one; seq; stamp
    append_text(message, "/odom");
    append_text(message, base);
    for (const double value : {0.1 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}) append_little_endian(message, value);
    const std::uint64_t time = i * std::uint64_t{1'000'000'000};
    EXPECT_TRUE(writer->write(*channel, time, time, message));
  }
  EXPECT_TRUE(writer->close());
  return file;
}

TEST(MessageLog, OldTransformsOfRos1AreNamedAsOdometry) {
  const Bytes file = old_transforms();
  const auto log = opened(as_text(file));
  ASSERT_TRUE(log);
  const auto setup = log->setup();
  ASSERT_TRUE(setup) << to_string(setup.error());
  EXPECT_EQ(setup->chosen.odometry, "/tf (odom to base_link)");
  const auto samples = samples_of(*log, log->topics_used(*setup));
  ASSERT_EQ(samples.size(), 10U);
  EXPECT_NEAR(std::get<Odometry>(samples[9]).odom_T_base.x(), 1.0, 1e-12);
}

/// Writes the files to a folder and opens them as one recording.
Result<std::unique_ptr<MessageLog>> opened_together(const std::map<std::string, Bytes>& files) {
  const std::filesystem::path folder = testing::fresh_folder("together");
  std::vector<std::string> paths;
  for (const auto& [name, bytes] : files) {
    const auto sink = create_file(folder / name);
    EXPECT_TRUE(sink && (*sink)->write(bytes));
    paths.push_back((folder / name).string());
  }
  return open_logs(paths);
}

Bytes bytes_of(std::string_view text) {
  Bytes bytes;
  append(bytes, as_bytes(text));
  return bytes;
}

TEST(MessageLog, OdometryInTransformsIsThatOfAnyPart) {
  const Bytes ranges = bytes_of("t_s,landmark,range_m,bearing_rad\n1,1,1,0\n2,2,1,0\n");
  const auto log = opened_together({{"a.csv", ranges}, {"b.mcap", old_transforms()}});
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ((*log)->format(), LogFormat::Merged);
  const auto setup = (*log)->setup();
  ASSERT_TRUE(setup);
  EXPECT_EQ(setup->chosen.odometry, "/tf (odom to base_link)");
  EXPECT_EQ(setup->chosen.notes.size(), 1U);
  EXPECT_EQ(samples_of(**log, (*log)->topics_used(*setup)).size(), 12U);
}

TEST(MessageLog, OdometryMessagesOfOnePartTakePrecedenceOverTransformsOfAnother) {
  const Bytes odometry =
      bytes_of("t_s,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n1,0,0,0,0,0\n2,0.1,0,0,0,0\n");
  const auto log = opened_together({{"a.csv", odometry}, {"b.mcap", old_transforms()}});
  ASSERT_TRUE(log) << to_string(log.error());
  const auto setup = (*log)->setup();
  ASSERT_TRUE(setup);
  EXPECT_FALSE(setup->chosen.odometry_frames);
  EXPECT_EQ(samples_of(**log, (*log)->topics_used(*setup)).size(), 2U);
}

TEST(MessageLog, TablesHaveNoTopicsToChooseFrom) {
  const Bytes ranges = bytes_of("t_s,landmark,range_m,bearing_rad\n1,1,1,0\n");
  const auto log = opened_together({{"a.csv", ranges}, {"b.csv", ranges}});
  ASSERT_TRUE(log) << to_string(log.error());
  const auto setup = (*log)->setup({.base_frame = "base", .camera_topic = "/camera"});
  ASSERT_TRUE(setup);
  EXPECT_FALSE(setup->chosen.ambiguous);
  EXPECT_FALSE(setup->chosen.mounting_error);
}

TEST(OpenLogs, TwoDrivesWithOdometryInTransformsAreRefused) {
  const auto twice = opened_together({{"a.mcap", old_transforms()}, {"b.mcap", old_transforms()}});
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(twice.error().message.find("/tf (odom to base_link)"), std::string::npos);
  EXPECT_TRUE(opened_together({{"a.mcap", old_transforms()}, {"b.mcap", old_transforms("/tf", "lift")}}))
      << "both have transforms, but only one has odometry";
  EXPECT_TRUE(opened_together({{"a.mcap", old_transforms()}, {"b.mcap", old_transforms("/r2/tf")}}));
}

TEST(MessageLog, JoinsASplitBagOfMcapFiles) {
  const std::filesystem::path folder = testing::fresh_folder("split_mcap");
  for (const auto& [name, first] : std::initializer_list<std::pair<const char*, int>>{
           {"b_0.mcap", 10}, {"b_1.mcap", 14}}) {  // they overlap by one message
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

TEST(MessageLog, IgnoresCopiesInAFolderAndRejectsTwoDrives) {
  const std::filesystem::path folder = testing::fresh_folder("copies_mcap");
  const auto write = [&](const char* name, ByteSpan bytes) {
    const auto sink = create_file(folder / name);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes));
  };
  const Bytes lap = ros1_mcap(10, 40);
  write("lap.mcap", lap);
  write("lap_copy.mcap", lap);
  write("lap_shorter.mcap", ros1_mcap(10, 30));  // the same messages without the last ones
  auto log = open_log(folder);
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(samples_of(**log).size(), 40U);
  std::vector<std::string> words;
  for (const LogProblem& problem : (*log)->problems()) words.push_back(to_string(problem.error));
  EXPECT_THAT(words, ::testing::Contains(::testing::HasSubstr("lap_copy.mcap")));
  for (const std::string& text : words) testing::expect_on_page("recording", text);
  Bytes other = ros1_mcap(11, 40);  // different messages at the same times
  write("other.mcap", other);
  log = open_log(folder);
  ASSERT_FALSE(log);
  EXPECT_EQ(log.error().code, ErrorCode::Unsupported);
  testing::expect_on_page("recording", log.error());
}

TEST(MessageLog, OtherFilesListTheSupportedFormats) {
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

TEST(LogProblemsTest, CountsRepetitionsAndKeepsTheFirstPlace) {
  LogProblems problems;
  int made = 0;
  for (int i = 0; i < 5; ++i) {
    problems.damage("row", [&] {
      ++made;
      return Error{ErrorCode::Unreadable, "row " + std::to_string(i), {}, {}};
    });
  }
  problems.trap(
      "unit",
      [] {
        return Error{ErrorCode::Unsupported, "millimetres", {}, {}};
      },
      7);
  EXPECT_EQ(made, 1) << "only built for the first problem with a key";
  ASSERT_EQ(problems.list().size(), 2U);
  EXPECT_EQ(problems.list()[0].count, 5U);
  EXPECT_EQ(problems.list()[0].error.message, "row 0");
  EXPECT_EQ(problems.list()[1].kind, LogProblem::Kind::Trap);
  EXPECT_EQ(problems.list()[1].count, 7U);
  LogProblems later;
  later.damages("other",
                {Error{ErrorCode::Unreadable, "a", {}, {}}, Error{ErrorCode::Unreadable, "b", {}, {}}});
  EXPECT_EQ(joined(problems, later).size(), 4U);
}

}  // namespace
}  // namespace waymark
