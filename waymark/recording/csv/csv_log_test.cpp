// Tables as recordings: all kinds of rows, invalid tables, and round trips of exported tables.
#include "waymark/recording/csv/csv_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/recording/export_log.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<MessageLog> table_of(std::string_view text) {
  auto log = open_log(memory_source(as_bytes(text), "table.csv"));
  EXPECT_TRUE(log) << to_string(log.error());
  return log ? std::move(*log) : nullptr;
}

struct Rows {
  std::vector<Sample> samples{};
  std::vector<LogProblem> problems{};
  [[nodiscard]] bool noticed(const std::string& key) const {
    return std::ranges::find(problems, key, &LogProblem::key) != problems.end();
  }
};

Rows rows_of(std::string_view text) {
  const auto log = table_of(text);
  Rows rows;
  if (!log) return rows;
  EXPECT_TRUE(log->visit_samples({}, [&](const Sample& sample) {
    rows.samples.push_back(sample);
    return Status();
  }));
  rows.problems = log->problems();
  return rows;
}

template <class T>
const T& at(const Rows& rows, std::size_t index) {
  EXPECT_LT(index, rows.samples.size());
  return std::get<T>(rows.samples.at(index));
}

Error refused(std::string_view text) {
  const auto log = open_log(memory_source(as_bytes(text), "table.csv"));
  EXPECT_FALSE(log) << text;
  return log ? Error{} : log.error();
}

std::int64_t ns_of(SensorTime stamp) { return stamp.time_since_epoch().count(); }

TEST(CsvLog, OdometryFromPosesSpeedsAnd3dPoses) {
  const Rows poses = rows_of("t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n5,1,-2,0.5,0.3,-0.1\n");
  EXPECT_EQ(ns_of(at<Odometry>(poses, 0).stamp), 5);
  EXPECT_EQ(at<Odometry>(poses, 0).odom_T_base.translation(), Eigen::Vector2d(1, -2));
  EXPECT_EQ(at<Odometry>(poses, 0).yaw_rate_rad_s, -0.1);

  const Rows speeds = rows_of("t_s,v_m_s,omega_rad_s\n1,9,9\n2,1,0\n4,0.5,0\n");
  EXPECT_EQ(at<Odometry>(speeds, 0).odom_T_base.x(), 0) << "there is no preceding interval";
  EXPECT_NEAR(at<Odometry>(speeds, 2).odom_T_base.x(), 2, 1e-12) << "1 m/s for 1 s, then 0.5 m/s for 2 s";
  EXPECT_TRUE(speeds.noticed("csv.integrated"));

  const Rows space = rows_of(
      "t_ns,body,px,py,pz,qx,qy,qz,qw\n1,base,1,2,3,0,0,0.70710678,0.70710678\n2,base,0,0,0,0,0,0,2\n");
  ASSERT_EQ(space.samples.size(), 1U) << "a quaternion of norm 2 is invalid";
  EXPECT_NEAR(at<Odometry>(space, 0).odom_T_base.yaw(), M_PI / 2, 1e-6);
  EXPECT_TRUE(space.noticed("csv.flattened"));
  EXPECT_TRUE(space.noticed("csv.row"));
}

TEST(CsvLog, ImuRangesAndTruth) {
  const Rows imu = rows_of(
      "t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2\n1,1,2,3,4,5,6\n");
  EXPECT_EQ(at<ImuSample>(imu, 0).angular_velocity_rad_s, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(at<ImuSample>(imu, 0).linear_acceleration_m_s2, Eigen::Vector3d(4, 5, 6));
  const Rows ranges = rows_of("t_ns,landmark,range_m,bearing_rad\n1,17,2.5,-0.25\n2,17,nan,0\n3,1.5,1,0\n");
  ASSERT_EQ(ranges.samples.size(), 1U);
  EXPECT_EQ(at<RangeBearing>(ranges, 0).landmark, 17);
  EXPECT_EQ(ranges.problems.at(0).count, 2U) << "invalid rows are counted in one problem";
  EXPECT_EQ(ranges.problems.at(0).error.place.line, 3) << "place of the first invalid row";
  const Rows truth = rows_of("t_ns,x_m,y_m,theta_rad,valid\n1,1,2,0.5,1\n2,9,9,9,0\n");
  ASSERT_EQ(truth.samples.size(), 1U);
  EXPECT_EQ(at<TruthPose>(truth, 0).map_T_base.translation(), Eigen::Vector3d(1, 2, 0));
  EXPECT_TRUE(truth.noticed("csv.truth_not_valid"));
}

TEST(CsvLog, RowsOfOneImageFormOneFrame) {
  const std::string head =
      "t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px\n";
  const std::string corners = ",1,2,3,4,5,6,7,8\n";
  const Rows rows = rows_of(head + "1,left,7" + corners + "1,left,tag25h9:3" + corners + "1,right,7" +
                            corners + "2,left,7" + corners);
  ASSERT_EQ(rows.samples.size(), 3U);
  EXPECT_EQ(at<TagFrame>(rows, 0).detections.size(), 2U);
  EXPECT_EQ(at<TagFrame>(rows, 0).detections[0].tag, (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_EQ(at<TagFrame>(rows, 0).detections[1].tag, (TagId{FamilyId::Tag25h9, 3}));
  EXPECT_EQ(at<TagFrame>(rows, 1).camera, "right");
  EXPECT_FALSE(rows.noticed("csv.frame_in_pieces"));
  EXPECT_TRUE(rows_of(head + "1,left,7" + corners + "1,right,7" + corners + "1,left,8" + corners)
                  .noticed("csv.frame_in_pieces"));
  const Rows bad = rows_of(head + "1,left,-3" + corners + "1,left,nonsense" + corners);
  EXPECT_TRUE(bad.samples.empty());
  EXPECT_EQ(bad.problems.at(0).count, 2U);
}

TEST(CsvLog, ConvertsTagSlamCornerOrderAndPixelCentres) {
  const Rows rows = rows_of("t_ns,cam,tag,x0,y0,x1,y1,x2,y2,x3,y3\n1,cam0,4,10,40,30,40,30,20,10,20\n");
  const auto& corners = at<TagFrame>(rows, 0).detections.at(0).corners_px;
  EXPECT_EQ(corners[0], Eigen::Vector2d(10.5, 20.5)) << "x3 y3 is the top left";
  EXPECT_EQ(corners[2], Eigen::Vector2d(30.5, 40.5));
  EXPECT_TRUE(rows.noticed("csv.tag_corners"));
}

TEST(CsvLog, AcceptsTablesOfOtherPrograms) {
  const Rows rows = rows_of(
      "\xEF\xBB\xBF\"t_s\" , landmark,\trange_m,bearing_rad,comment\r\n# words\r\n\r\n 1.5 ,\"3\", 2 "
      ",0,hello\r\n"
      "1609357294.418400001,4,1,0,\r\n2,5,1,0");
  ASSERT_EQ(rows.samples.size(), 2U) << "the last row has a missing cell";
  EXPECT_EQ(ns_of(stamp_of(rows.samples[0])), 1'500'000'000);
  EXPECT_EQ(at<RangeBearing>(rows, 0).landmark, 3);
  EXPECT_EQ(ns_of(stamp_of(rows.samples[1])), 1'609'357'294'418'400'001) << "exact to the nanosecond";
}

TEST(CsvLog, ReportsWhyATableIsInvalid) {
  const Error twice = refused("t_ns,x_m,x_m\n1,2,3\n");
  EXPECT_THAT(twice.message, HasSubstr("'x_m'"));
  testing::expect_on_page("recording", twice);
  EXPECT_EQ(twice.place.line, 1);
  EXPECT_THAT(refused("x_m,y_m,theta_rad\n1,2,3\n").hint, HasSubstr("t_ns"));
  EXPECT_THAT(refused("t_ns,foo,bar\n1,2,3\n").hint, HasSubstr("range_m"));
  EXPECT_FALSE(refused("t_ns,body,px,py,pz,qx,qy,qz,qw,cov0\n").message.empty()) << "an estimate";
}

TEST(CsvLog, ReportsBackwardTimeAndKeepsRowOrder) {
  const Rows rows = rows_of("t_ns,landmark,range_m,bearing_rad\n5,1,1,0\n3,2,1,0\n7,3,1,0\n");
  ASSERT_EQ(rows.samples.size(), 3U);
  EXPECT_EQ(at<RangeBearing>(rows, 1).landmark, 2);
  EXPECT_TRUE(rows.noticed("csv.time_back"));
}

TEST(CsvText, NumbersAreFiniteAndSecondsAreExact) {
  EXPECT_EQ(csv::number("-1.5e3"), -1500.0);
  for (const char* none : {"", "x", "1x", "nan", "inf", "1e999", "0x10"})
    EXPECT_FALSE(csv::number(none)) << none;
  EXPECT_EQ(csv::integer("-12"), -12);
  for (const char* none : {"", "1.0", "99999999999999999999"}) EXPECT_FALSE(csv::integer(none)) << none;
  EXPECT_EQ(csv::seconds_as_ns("-0.25"), -250'000'000);
  EXPECT_EQ(csv::seconds_as_ns("1.0000000019"), 1'000'000'001) << "fractions of a nanosecond are truncated";
  EXPECT_EQ(csv::seconds_as_ns("1e3"), 1'000'000'000'000);
  EXPECT_FALSE(csv::seconds_as_ns("1e20"));
  EXPECT_FALSE(csv::seconds_as_ns("1.5s"));
}

TEST(CsvText, ReadsLinesOfAnyLengthAndTruncatesAtTheLimit) {
  std::string text = "short\n" + std::string(600'000, 'a') + "\r\nlast";
  const auto source = memory_source(as_bytes(text));
  csv::LineReader lines(*source, text.size(), 1000);
  EXPECT_TRUE(lines.next()->text == "short");
  const auto longest = lines.next();
  ASSERT_TRUE(longest);
  EXPECT_EQ(longest->number, 2);
  EXPECT_EQ(longest->text.size(), 1000U);
  const auto last = lines.next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->text.substr(0, 10), "last");
  EXPECT_EQ(last->number, 3);
  EXPECT_EQ(last->offset, text.size() - 4);
  EXPECT_FALSE(lines.next());
}

/// A Waymark recording with a hundred samples of each kind that can be exported as a table.
Bytes recording() {
  Random random(4);
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  EXPECT_TRUE(recorder);
  for (int i = 0; i < 100; ++i) {
    const SensorTime stamp{Duration(1'700'000'000'000'000'000 + 7'000'001LL * i)};
    TagFrame frame{.stamp = stamp};
    for (int t = 0; t < 2; ++t) {
      TagDetection tag{
          .tag = {FamilyId::Tag36h11, t}, .hamming = t, .decision_margin = random.uniform(0, 99)};
      for (auto& corner : tag.corners_px) corner = {random.uniform(0, 640), random.uniform(0, 480)};
      frame.detections.push_back(tag);
    }
    EXPECT_TRUE(recorder->add(frame));
    EXPECT_TRUE(
        recorder->add(Odometry{stamp, SE2(random.uniform(-5, 5), 1, random.uniform(-3, 3)), 0.1, 0.2}));
    EXPECT_TRUE(recorder->add(ImuSample{stamp, {random.uniform(-1, 1), 0, 0}, {0, 0, 9.8}}));
    EXPECT_TRUE(recorder->add(RangeBearing{stamp, i % 9, random.uniform(0, 5), random.uniform(-3, 3)}));
  }
  EXPECT_TRUE(recorder->close());
  return file;
}

std::string exported(MessageLog& log, const std::string& kind) {
  Bytes bytes;
  const auto report = export_csv(log, memory_sink(bytes), {.kind = kind});
  EXPECT_TRUE(report) << kind << ": " << to_string(report.error());
  return std::string(as_text(bytes));
}

/// Compares two tables cell by cell: numbers within 1e-12, text exactly.
void expect_same_cells(const std::string& a, const std::string& b) {
  std::vector<std::string_view> cells_a;
  std::vector<std::string_view> cells_b;
  const auto source_a = memory_source(as_bytes(a));
  const auto source_b = memory_source(as_bytes(b));
  csv::LineReader lines_a(*source_a, a.size(), 10'000);
  csv::LineReader lines_b(*source_b, b.size(), 10'000);
  int rows = 0;
  for (auto line = lines_a.next(); line; line = lines_a.next(), ++rows) {
    const auto other = lines_b.next();
    ASSERT_TRUE(other) << "row " << rows;
    csv::split(line->text, cells_a);
    csv::split(other->text, cells_b);
    ASSERT_EQ(cells_a.size(), cells_b.size());
    for (std::size_t i = 0; i < cells_a.size(); ++i) {
      const auto number = csv::number(cells_a[i]);
      if (i > 0 && number)
        EXPECT_NEAR(*number, csv::number(cells_b[i]).value_or(1e9), 1e-12) << "row " << rows;
      else
        EXPECT_EQ(cells_a[i], cells_b[i]) << "row " << rows;
    }
  }
  EXPECT_FALSE(lines_b.next());
  EXPECT_GT(rows, 100);
}

TEST(ExportCsv, TablesRoundTrip) {
  const Bytes file = recording();
  auto log = open_log(memory_source(file));
  ASSERT_TRUE(log);
  for (const char* kind : {"detections", "odometry", "imu", "range-bearing"}) {
    const std::string table = exported(**log, kind);
    const auto back = table_of(table);
    ASSERT_TRUE(back) << kind;
    expect_same_cells(exported(*back, ""), table);  // the kind need not be given if there is only one
    EXPECT_TRUE(back->problems().empty()) << kind;
  }
}

/// A recording with two tags in each of `frames` images, of which the first is unreliable, and the second too
/// if `all`.
Bytes with_unreliable_tags(int frames, bool all) {
  Bytes file;
  auto recorder = SampleRecorder::open(memory_sink(file));
  EXPECT_TRUE(recorder);
  for (int i = 0; i < frames; ++i) {
    TagFrame frame{.stamp = SensorTime(std::chrono::milliseconds(1000 + i)), .detections = {{}, {}}};
    for (TagDetection& tag : frame.detections) tag.corners_px.fill(Eigen::Vector2d(1, 2));
    frame.detections[0].corner_state = CornerState::Unreliable;
    frame.detections[1].tag.number = 1;
    if (all) frame.detections[1].corner_state = CornerState::Unreliable;
    EXPECT_TRUE(recorder->add(frame));
  }
  EXPECT_TRUE(recorder->close());
  return file;
}

TEST(ExportCsv, UnreliableTagsAreNotInTheTableButReported) {
  const Bytes file = with_unreliable_tags(3, false);
  auto log = open_log(memory_source(file));
  ASSERT_TRUE(log);
  Bytes out;
  const auto report = export_csv(**log, memory_sink(out), {.kind = "detections"});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->messages, 3U);
  EXPECT_THAT(std::string(as_text(out)), Not(HasSubstr("tag36h11:0")));
  ASSERT_EQ(report->problems.size(), 1U);
  EXPECT_EQ(report->problems[0].key, "csv.unreliable_corners");
  EXPECT_EQ(report->problems[0].kind, LogProblem::Kind::Trap);
  EXPECT_EQ(report->problems[0].count, 3U);
}

TEST(ExportCsv, FailsIfAllTagsAreUnreliable) {
  const Bytes file = with_unreliable_tags(2, true);
  auto log = open_log(memory_source(file));
  ASSERT_TRUE(log);
  Bytes out;
  const auto report = export_csv(**log, memory_sink(out), {.kind = "detections"});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::NotFound);
  EXPECT_THAT(report.error().message, HasSubstr("all 4 detections"));
}

TEST(ExportCsv, OneOfSeveralKindsMustBeChosen) {
  const Bytes file = recording();
  auto log = open_log(memory_source(file));
  ASSERT_TRUE(log);
  Bytes out;
  const auto several = export_csv(**log, memory_sink(out), {});
  ASSERT_FALSE(several);
  EXPECT_THAT(several.error().hint, HasSubstr("`kind=detections`"));
  const auto unknown = export_csv(**log, memory_sink(out), {.kind = "images"});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().hint, HasSubstr("odometry"));
  const auto none = export_csv(**log, memory_sink(out), {.selection = {.to = 5}, .kind = "imu"});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace waymark
