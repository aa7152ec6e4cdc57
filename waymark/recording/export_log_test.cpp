// Conversions of recordings: poses as TUM lines, several files from one drive as one, progress, and errors
// from its callback.
#include "waymark/recording/export_log.hpp"

#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/logged_poses.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// Twenty seconds of odometry along x at 10 Hz; the caller adds other messages.
template <class More>
Bytes drive(More&& more, double from_s = 100) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  EXPECT_TRUE(recorder);
  for (int i = 0; i < 200; ++i)
    EXPECT_TRUE(recorder->add(Odometry{at_s(from_s + 0.1 * i), SE2(0.05 * i, 0, 0.01 * i), 0.5, 0.1}));
  more(*recorder);
  EXPECT_TRUE(recorder->close());
  return file;
}

Bytes plain_drive() {
  return drive([](SampleRecorder&) {});
}

std::unique_ptr<MessageLog> log_of(ByteSpan bytes) {
  auto log = open_log(memory_source(bytes, "memory"));
  EXPECT_TRUE(log) << to_string(log.error());
  return log ? std::move(*log) : nullptr;
}

struct TumLine {
  double t, x, y, z, qx, qy, qz, qw;
};

std::vector<TumLine> lines_of(ByteSpan bytes) {
  std::istringstream text{std::string(as_text(bytes))};
  std::vector<TumLine> lines;
  for (TumLine l{}; text >> l.t >> l.x >> l.y >> l.z >> l.qx >> l.qy >> l.qz >> l.qw;) lines.push_back(l);
  EXPECT_TRUE(text.eof());
  return lines;
}

Result<std::vector<TumLine>> tum_of(MessageLog& log, const ExportOptions& options = {}) {
  Bytes bytes;
  const auto report = export_tum(log, memory_sink(bytes), options);
  if (!report) return tl::unexpected(report.error());
  std::vector<TumLine> lines = lines_of(bytes);
  EXPECT_EQ(report->messages, lines.size());
  return lines;
}

TEST(ExportTum, WritesOneLinePerPoseInTimeOrder) {
  const Bytes file = plain_drive();
  const auto lines = tum_of(*log_of(file));
  ASSERT_TRUE(lines) << to_string(lines.error());
  ASSERT_EQ(lines->size(), 200U);
  EXPECT_DOUBLE_EQ((*lines)[7].t, 100.7);
  EXPECT_DOUBLE_EQ((*lines)[7].x, 0.35);
  EXPECT_NEAR(2 * std::atan2((*lines)[7].qz, (*lines)[7].qw), 0.07, 1e-12);
}

TEST(ExportTum, SelectsAHalfOpenInterval) {
  const Bytes file = plain_drive();
  ExportOptions options;
  options.selection.from = 101'000'000'000;
  options.selection.to = 102'000'000'000;
  const auto lines = tum_of(*log_of(file), options);
  ASSERT_TRUE(lines);
  EXPECT_EQ(lines->size(), 10U);
  EXPECT_DOUBLE_EQ(lines->front().t, 101);
  options.selection.from = 1'000'000'000'000;
  options.selection.to = std::numeric_limits<std::uint64_t>::max();
  EXPECT_FALSE(tum_of(*log_of(file), options)) << "the selection is empty";
}

TEST(ExportTum, RequiresOneOfSeveralTopicsToBeChosen) {
  const Bytes file = drive([](SampleRecorder& recorder) {
    for (int i = 0; i < 5; ++i)
      EXPECT_TRUE(recorder.add(TruthPose{at_s(100 + i), SE3(SO3(), {1, 2, 0.5 * i})}));
  });
  const auto log = log_of(file);
  EXPECT_THAT(pose_topics(*log), ::testing::UnorderedElementsAre(topics::kOdometry, topics::kTruth));
  const auto several = tum_of(*log);
  ASSERT_FALSE(several);
  EXPECT_THAT(several.error().message, HasSubstr(topics::kTruth));
  ExportOptions options;
  options.selection.topics = {topics::kTruth};
  const auto truth = tum_of(*log, options);
  ASSERT_TRUE(truth);
  ASSERT_EQ(truth->size(), 5U);
  EXPECT_EQ(truth->back().z, 2);
}

TEST(ExportTum, SkipsAndNotesANonFinitePose) {
  const Bytes file = drive([](SampleRecorder& recorder) {
    ros2::PoseStamped pose;
    for (const double x : {1.0, std::numeric_limits<double>::quiet_NaN(), 3.0}) {
      pose.header.stamp = ros2::to_ros(at_s(125));
      pose.pose = ros2::to_ros(SE3(SO3(), {x, 0, 0}));
      EXPECT_TRUE(recorder.add_message("/estimate", at_s(125), pose));
    }
  });
  const auto log = log_of(file);
  std::vector<double> x_m;
  std::vector<LogProblem> problems;
  ASSERT_TRUE(visit_poses(
      *log, "/estimate", {},
      [&](const EstimatedPose& pose) {
        x_m.push_back(pose.map_T_base.translation().x());
        EXPECT_FALSE(pose.covariance) << "all zeros mean unknown";
        return Status();
      },
      problems));
  EXPECT_THAT(x_m, ElementsAre(1, 3));
  std::vector<std::string> keys;
  for (const LogProblem& problem : problems) keys.push_back(problem.key + ": " + to_string(problem.error));
  EXPECT_THAT(keys, ElementsAre(HasSubstr("poses.message")));
}

TEST(VisitPoses, PassesThePlanarCovariance) {
  const Bytes file = drive([](SampleRecorder& recorder) {
    ros2::PoseWithCovarianceStamped pose;
    pose.header.stamp = ros2::to_ros(at_s(101));
    pose.pose.pose = ros2::to_ros(SE3());
    for (std::size_t i = 0; i < 36; ++i) pose.pose.covariance[i] = static_cast<double>(i);
    EXPECT_TRUE(recorder.add_message("/estimate", at_s(101), pose));
  });
  std::vector<LogProblem> problems;
  int poses = 0;
  ASSERT_TRUE(visit_poses(
      *log_of(file), "/estimate", {},
      [&](const EstimatedPose& pose) {
        ++poses;
        Eigen::Matrix3d expected;
        expected << 0, 1, 5, 6, 7, 11, 30, 31, 35;
        EXPECT_EQ(*pose.covariance, expected) << "rows and columns x, y and the rotation about z";
        return Status();
      },
      problems));
  EXPECT_EQ(poses, 1);
}

TEST(ExportProgress, IsReportedAndItsErrorStopsTheExport) {
  Bytes table;
  append(table, as_bytes("t_s,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n"));
  for (int i = 0; i < 2000; ++i) append(table, as_bytes(std::to_string(i) + ",1,2,0.1,0,0\n"));
  for (const auto write : {export_mcap, export_tum, export_csv}) {
    const auto log = log_of(table);
    std::vector<double> progress;
    ExportOptions options{.progress = [&](double done) {
      progress.push_back(done);
      return Status();
    }};
    Bytes out;
    ASSERT_TRUE(write(*log, memory_sink(out), options));
    ASSERT_GE(progress.size(), 3U);
    EXPECT_TRUE(std::ranges::is_sorted(progress));
    EXPECT_GE(progress.front(), 0);
    EXPECT_LE(progress.back(), 1);
    options.progress = [](double) -> Status { return fail(ErrorCode::Unwritable, "enough"); };
    const auto stopped = write(*log, memory_sink(out), options);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().message, "enough");
  }
}

TEST(ExportMcap, ALaterPartKeepsCalibrationAndMounting) {
  const auto camera = CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480);
  ASSERT_TRUE(camera);
  const SE3 base_T_cam(SO3::from_rpy(-1.5, 0, -1.57), {0.08, 0, 0.18});
  const Bytes file = drive(
      [&](SampleRecorder& recorder) { EXPECT_TRUE(recorder.add_camera(at_s(100), *camera, base_T_cam)); });
  for (const double from_s : {100.0, 105.0, 119.5}) {
    ExportOptions options;
    options.selection.from = static_cast<std::uint64_t>(from_s * 1e9);
    Bytes part;
    const auto report = export_mcap(*log_of(file), memory_sink(part), options);
    ASSERT_TRUE(report) << to_string(report.error());
    const auto log = log_of(part);
    const auto setup = log->setup();
    ASSERT_TRUE(setup) << to_string(setup.error());
    ASSERT_TRUE(setup->camera && setup->base_T_cam) << from_s;
    EXPECT_LT((setup->base_T_cam->inverse() * base_T_cam).translation().norm(), 1e-9);
    EXPECT_GE(*log->summary().start, options.selection.from) << "no message precedes the part";
    EXPECT_EQ(report->by_topic.at(topics::kCameraInfo), 1U);
  }
}

TEST(ExportMcap, CopiesMetadataAttachmentsAndStamps) {
  const Bytes file = drive([](SampleRecorder& recorder) {
    EXPECT_TRUE(recorder.add_metadata("waymark", {{"anchor", "tag36h11:0"}}));
    EXPECT_TRUE(recorder.add_attachment("robot.yaml", "application/yaml", at_s(1), "name: limo\n"));
  });
  Bytes out;
  const auto report = export_mcap(*log_of(file), memory_sink(out), {.metadata = {{"import", {{"a", "b"}}}}});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->by_topic, (std::map<std::string, std::uint64_t>{{"/odom", 200}}));
  const auto back = log_of(out);
  EXPECT_EQ(back->setup()->metadata.at("waymark").at("anchor"), "tag36h11:0");
  EXPECT_EQ(back->setup()->metadata.at("import").at("a"), "b");
  std::string text;
  ASSERT_TRUE(back->visit_attachments([&](const MessageLog::Attachment& attachment) {
    text += attachment.name + ": " + std::string(as_text(attachment.data));
    return Status();
  }));
  EXPECT_EQ(text, "robot.yaml: name: limo\n");
  EXPECT_EQ(back->summary().start, 100'000'000'000U);
}

TEST(ExportLog, OmitsAndReportsADamagedAttachment) {
  Bytes file = drive([](SampleRecorder& recorder) {
    EXPECT_TRUE(recorder.add_attachment("map.yaml", "application/yaml", at_s(1), "anchor: 3\n"));
    EXPECT_TRUE(recorder.add_attachment("robot.yaml", "application/yaml", at_s(1), "name: limo\n"));
  });
  file[as_text(file).find("anchor: 3")] = 'e';
  const auto log = log_of(file);
  Bytes out;
  const auto report = export_mcap(*log, memory_sink(out), {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(std::ranges::any_of(report->problems, [](const LogProblem& problem) {
    return problem.error.message.find("'map.yaml'") != std::string::npos;
  }));
  for (const LogProblem& problem : report->problems) testing::expect_on_page("convert", problem.error);
  const auto back = log_of(out);
  ASSERT_EQ(back->attachments().size(), 1U);
  EXPECT_EQ(back->attachments()[0].name, "robot.yaml");
  EXPECT_EQ(back->summary().messages, log->summary().messages);
}

class SeveralFiles : public ::testing::Test {
 protected:
  [[nodiscard]] std::string write(const std::string& name, ByteSpan bytes) const {
    auto sink = create_file(folder_ / name);
    EXPECT_TRUE(sink);
    EXPECT_TRUE((*sink)->write(bytes));
    return (folder_ / name).string();
  }
  std::string odometry_ =
      "t_s,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n1,0,0,0,1,0\n2,1,0,0,1,0\n3,2,0,0,1,0\n";
  std::string ranges_ = "t_s,landmark,range_m,bearing_rad\n1.5,7,1,0\n2.5,8,1,0\n";
  fs::path folder_ = testing::fresh_folder("several_files");
};

TEST_F(SeveralFiles, OfOneDriveAreMergedInStampOrder) {
  const std::vector<std::string> files = {write("ranges.csv", as_bytes(ranges_)),
                                          write("odometry.csv", as_bytes(odometry_))};
  auto log = open_logs(files);
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ((*log)->format(), LogFormat::Merged);
  EXPECT_THAT((*log)->description(), HasSubstr(" and "));
  EXPECT_EQ((*log)->summary().messages, 5U);
  EXPECT_EQ((*log)->summary().start, 1'000'000'000U);
  EXPECT_EQ((*log)->summary().end, 3'000'000'000U);
  EXPECT_EQ((*log)->summary().files, files);
  std::vector<double> stamps;
  ASSERT_TRUE((*log)->visit_samples({}, [&](const Sample& sample) {
    stamps.push_back(to_seconds(stamp_of(sample).time_since_epoch()));
    return Status();
  }));
  EXPECT_THAT(stamps, ElementsAre(1, 1.5, 2, 2.5, 3));
  EXPECT_THAT((*log)->problems(), IsEmpty());
}

TEST_F(SeveralFiles, ExportsPosesOfMergedTables) {
  auto log = open_logs({write("ranges.csv", as_bytes(ranges_)), write("odometry.csv", as_bytes(odometry_))});
  ASSERT_TRUE(log);
  ExportOptions options;
  const auto lines = tum_of(**log, options);
  ASSERT_TRUE(lines) << to_string(lines.error());
  ASSERT_EQ(lines->size(), 3U);
  EXPECT_EQ(lines->back().x, 2);
}

TEST_F(SeveralFiles, CopiesAttachmentsOfEachFile) {
  const Bytes lap = drive([](SampleRecorder& recorder) {
    EXPECT_TRUE(recorder.add_attachment("robot.yaml", "application/yaml", at_s(1), "name: limo\n"));
  });
  auto log = open_logs({write("lap.mcap", lap), write("ranges.csv", as_bytes(ranges_))});
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ((*log)->attachments().size(), 1U);
  Bytes out;
  ASSERT_TRUE(export_mcap(**log, memory_sink(out), {}));
  const auto back = log_of(out);
  EXPECT_EQ(back->summary().messages, 202U);
  ASSERT_EQ(back->attachments().size(), 1U) << "the robot's file";
  EXPECT_EQ(back->attachments()[0].name, "robot.yaml");
}

TEST_F(SeveralFiles, RejectsOdometryOfTwoDrivesAtTheSameTime) {
  const std::string first = write("first.mcap", plain_drive());
  const std::string second = write("second.mcap", drive([](SampleRecorder&) {}, 110));
  const auto both = open_logs({first, second});
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().place.source, second);
  EXPECT_THAT(both.error().message, HasSubstr("first.mcap"));
  testing::expect_on_page("convert", both.error());
  const std::string later = write("later.mcap", drive([](SampleRecorder&) {}, 200));
  const auto parts = open_logs({first, later});
  ASSERT_TRUE(parts) << to_string(parts.error());
  EXPECT_EQ((*parts)->format(), LogFormat::Mcap) << "consecutive parts form one recording";
  EXPECT_EQ((*parts)->summary().messages, 400U);
  EXPECT_FALSE(open_logs({}));
  EXPECT_FALSE(open_logs({first, (folder_ / "none.csv").string()}));
}

TEST_F(SeveralFiles, NotesADamagedPart) {
  auto log = open_logs(
      {write("ranges.csv", as_bytes(ranges_ + "x,9,1,0\n")), write("odometry.csv", as_bytes(odometry_))});
  ASSERT_TRUE(log);
  int samples = 0;
  ASSERT_TRUE((*log)->visit_samples({}, [&](const Sample&) {
    ++samples;
    return Status();
  }));
  EXPECT_EQ(samples, 5);
  ASSERT_EQ((*log)->problems().size(), 1U);
  EXPECT_EQ((*log)->problems()[0].key, "csv.row");
  EXPECT_EQ((*log)->problems()[0].error.place.line, 4);
}

}  // namespace
}  // namespace waymark
