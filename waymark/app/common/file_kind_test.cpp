// Tests that every file the program writes or reads, and unknown files, are assigned the right kind.
#include "waymark/app/common/file_kind.hpp"

#include <fstream>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/camera_texts.hpp"
#include "tests/support/data.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/exchange/map_exchange.hpp"
#include "waymark/config/exchange/tagslam.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/sdf/write_sdf.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;
using ::testing::HasSubstr;

MapFile map_of_two() {
  MapFile map{.anchor = {FamilyId::Tag36h11, 7}};
  for (const int number : {7, 9})
    map.tags.tags.emplace(
        TagId{FamilyId::Tag36h11, number},
        MappedTag{.map_T_tag = SE3(SO3::from_rpy(-1.5707963267948966, 0, 0), {1.0 * number, 0, 0.3}),
                  .size_m = 0.16});
  return map;
}

std::string map_as(MapForm form) {
  std::vector<std::string> warnings;
  return to_text(map_of_two(), form, warnings).value_or("");
}

Route short_route() {
  Route route{.length_m = 1};
  for (int i = 0; i <= 10; ++i)
    route.points.push_back({.map_T_base = SE2(0.1 * i, 0, 0), .arc_length_m = 0.1 * i, .speed_m_s = 0.3});
  return route;
}

std::string shared(const char* folder, const char* name) {
  const auto path = find_shared(folder, name);
  return path ? read_text_file(*path, kMaxTextBytes).value_or("") : "";
}

class FileKinds : public ::testing::Test {
 protected:
  FileKind written(const std::string& name, std::string_view bytes) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return kind_of(folder_ / name);
  }
  std::string recording(const std::string& name) const {
    auto recorder = SampleRecorder::open(std::move(*create_file(folder_ / name)));
    EXPECT_TRUE(recorder);
    EXPECT_TRUE(recorder->add(Odometry{SensorTime(), SE2(), 0, 0}));
    EXPECT_TRUE(recorder->close());
    return (folder_ / name).string();
  }
  std::string error(const std::string& name, FileUse use) const {
    const auto wrong = wrong_kind(folder_ / name, use);
    return wrong ? to_string(*wrong) : "";
  }
  fs::path folder_ = testing::fresh_folder("file_kinds");
};

TEST_F(FileKinds, FilesWrittenByTheProgramAreRecognised) {
  const Image image(8, 8);
  const auto png = encode_png(image.view());
  const auto jpeg = encode_jpeg(image.view(), 90);
  const auto pnm = encode_pnm(image.view());
  ASSERT_TRUE(png && jpeg && pnm);
  EXPECT_EQ(written("a", as_text(*png)), FileKind::Image);
  EXPECT_EQ(written("a", as_text(*jpeg)), FileKind::Image);
  EXPECT_EQ(written("a", as_text(*pnm)), FileKind::Image);
  EXPECT_EQ(kind_of(recording("lap")), FileKind::Mcap);
  for (const auto packing : {Compression::Zstd}) {
    Bytes packed;
    ASSERT_TRUE(compress(packing, as_bytes("packed"), packed));
    EXPECT_EQ(written("a", as_text(packed)), FileKind::Packed);
  }

  const auto camera = parse_camera(testing::kCameraInfo, "camera");
  const auto robot = read_named_robot("limo");
  const auto world = parse_world(shared("worlds", "circuit24"), "world");
  ASSERT_TRUE(camera && robot && world);
  const nlohmann::ordered_json found =
      to_json(fields(ImageLine{ImageReport{.image = "a.png", .detected = true}}));
  const SdfFiles sdf = write_sdf_world(*world, *robot);
  const std::pair<FileKind, std::string> texts[] = {
      {FileKind::Map, to_yaml(map_of_two())},
      {FileKind::AcademyMap, map_as(MapForm::Academy)},
      {FileKind::TagslamBodies, map_as(MapForm::Tagslam)},
      {FileKind::TagTransforms, map_as(MapForm::Transforms)},
      {FileKind::WpilibLayout, map_as(MapForm::Wpilib)},
      {FileKind::Fmap, map_as(MapForm::Fmap)},
      {FileKind::Route, to_yaml(short_route())},
      {FileKind::Calibration, to_yaml(Calibration{.camera = camera->camera})},
      {FileKind::Camera, to_camera_info_yaml(*camera)},
      {FileKind::Camera, to_camchain_yaml({*camera}).value_or("")},
      {FileKind::Camera, to_opencv_yaml(*camera)},
      {FileKind::Camera, to_photonvision_json(*camera).value_or("")},
      {FileKind::Robot, to_yaml(*robot)},
      {FileKind::World, to_yaml(*world)},
      {FileKind::SdfWorld, sdf.world},
      {FileKind::Detections, found.dump() + "\n" + found.dump() + "\n"},
      {FileKind::TumTrajectory, to_tum({{SensorTime(), SE3()}})},
      {FileKind::CsvLog, "t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n"},
      {FileKind::Table, "# stamp_s, covariance of x y z [m], lower triangle by rows\n0.5,1,2,3\n1.5,1,2,3\n"},
      {FileKind::Document, "<svg xmlns=\"http://www.w3.org/2000/svg\">"},
      {FileKind::Document, "%PDF-1.5\n"},
      {FileKind::Document, "<!DOCTYPE html>\n<html>"}};
  for (const auto& [kind, text] : texts) {
    EXPECT_EQ(written("a", text), kind) << text.substr(0, 200);
    EXPECT_EQ(kind_of_content(text, "-"), kind) << text.substr(0, 200);
  }
}

TEST_F(FileKinds, FilesOfOtherProgramsAreRecognised) {
  const std::pair<FileKind, std::string_view> heads[] = {
      {FileKind::Mcap, "\x89MCAP0\r\n"sv},
      {FileKind::Ros1Bag, "#ROSBAG V2.0\n"sv},
      {FileKind::Ros1Bag, "#ROSBAG V1.1\n"sv},
      {FileKind::Rosbag2, "SQLite format 3\0"sv},
      {FileKind::Packed, "BZh91AY"sv},
      {FileKind::Video,
       "\0\0\0\x18"
       "ftypmp42"sv},
      {FileKind::Video, "\x1A\x45\xDF\xA3 matroska"sv},
      {FileKind::Camera, testing::kCamchain},
      {FileKind::TagslamFile, "cam0:\n  pose:\n    position:\n      x: 0\n"},
      {FileKind::TagslamFile,
       "tagslam_parameters:\n  pixel_noise: 1\nbody_defaults:\n  position_noise: 0.1\n"},
      {FileKind::TagslamFile, R"({"test": 1, "cameras": [], "bodies": []})"},
      {FileKind::Faults, "# What goes wrong\nfaults:\n  - {fault: camera_lost, at_s: 5, for_s: 2}\n"},
      {FileKind::WpilibLayout, "ID,X,Y,Z,Z-Rotation,X-Rotation\n1,593.68,9.68,53.38,120,0\n"},
      {FileKind::TumTrajectory, "# t x y z q\n\n1 0 0 0 0 0 0 1\n2 3 4 0 0 0 0 1\n"},
      {FileKind::TumTrajectory, "1,0,0,0,0,0,0,1\n"},
      {FileKind::CsvLog, "\xEF\xBB\xBFt_s,landmark,range_m,bearing_rad\r\n"},
      {FileKind::TrueCorners, "image,id,x0,y0,x1,y1,x2,y2,x3,y3\n"},
      {FileKind::Points, "landmark,x_m,y_m\n0,5.3,0.6\n"},
      {FileKind::Path, "x_m,y_m\n0,0\n"},
      {FileKind::Path, "# s,x,y,theta,kappa\n0.0,0.5,0.04,-2.9,1.0\n"},
      {FileKind::Table, "parent,child\nmap,perch\n"}};
  for (const auto& [kind, head] : heads) EXPECT_EQ(written("a", head), kind) << head;
  for (const char* name : {"limo", "turtlebot3"})
    EXPECT_EQ(written("a", shared("ros2", name)), FileKind::TopicProfile) << name;
  EXPECT_EQ(written("a", shared("gazebo", "limo")), FileKind::TopicProfile);
}

TEST_F(FileKinds, FoldersAreRecognisedByTheirContents) {
  EXPECT_EQ(kind_of(folder_), FileKind::Unknown) << "empty";
  written("map/map.yaml", to_yaml(map_of_two()));
  written("bag/a_0.db3", "SQLite format 3\0"sv);
  written("bag/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
  written("scene/tagslam.yaml", "tagslam_parameters:\n  pixel_noise: 1\n");
  written("other/config.json", R"({"editor": 4})");
  EXPECT_EQ(kind_of(folder_ / "map"), FileKind::MapFolder);
  EXPECT_EQ(kind_of(folder_ / "bag"), FileKind::BagFolder);
  EXPECT_EQ(kind_of(folder_ / "scene"), FileKind::TagslamFolder);
  EXPECT_EQ(kind_of(folder_ / "other"), FileKind::Unknown);
  fs::create_directories(folder_ / "walk.mp4");
  EXPECT_EQ(kind_of(folder_ / "walk.mp4"), FileKind::Unknown);
}

TEST_F(FileKinds, VideosAndMapsAreAlsoRecognisedByName) {
  for (const char* name : {"empty.mp4", "torn.AVI", "raw.h264"}) {
    EXPECT_EQ(written(name, ""), FileKind::Video) << name;
    EXPECT_EQ(written(name, "no video, at all\n"), FileKind::Video) << name;
  }
  EXPECT_EQ(kind_of(folder_ / "none.mp4"), FileKind::Video);
  EXPECT_EQ(written("map.yaml", "nothing\n"), FileKind::Map);
  EXPECT_EQ(kind_of(recording("lap.mp4")), FileKind::Mcap) << "the content overrides the name";
}

TEST_F(FileKinds, EmptyTruncatedAndRandomFilesAreUnknown) {
  EXPECT_EQ(written("empty", ""), FileKind::Unknown);
  EXPECT_EQ(kind_of(folder_ / "none"), FileKind::Unknown);
  EXPECT_EQ(kind_of("/dev/zero"), FileKind::Unknown) << "only regular files are read";
  for (const std::string_view cut :
       {"\x89"sv, "\x89MCA"sv, "#ROSBA"sv, "SQLite"sv, "\xFF\xD8"sv, "\x89PN"sv, "{"sv, "{\"tags\""sv,
        "format: waymark-ma"sv, "tags:\n"sv, "tags: tag"sv, "x"sv, ","sv, "\n"sv, "#"sv, "1 2 3\n"sv,
        "Hello, world\n"sv, "words alone\n"sv, "\xEF\xBB\xBF"sv})
    EXPECT_EQ(written("cut", cut), FileKind::Unknown) << cut;
  std::minstd_rand random(1);
  for (int round = 0; round < 300; ++round) {
    std::string bytes(static_cast<std::size_t>(round) * 5, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    EXPECT_EQ(kind_of_content(bytes, "random"), FileKind::Unknown) << round;
  }
}

/// Truncating a known file at any point must neither crash nor cause an out-of-bounds read.
TEST_F(FileKinds, EveryTruncationOfAFileHasAKind) {
  for (const std::string& text : {to_yaml(map_of_two()), map_as(MapForm::Academy), map_as(MapForm::Wpilib),
                                  std::string(testing::kCamchain), std::string("t_s,x_m\n1,2\n")})
    for (std::size_t size = 0; size <= text.size(); ++size)
      static_cast<void>(kind_of_content(std::string_view(text).substr(0, size), "cut"));
}

TEST_F(FileKinds, AFileOfTheWrongKindIsReportedWithTheVerbsThatTakeIt) {
  const std::string lap = recording("lap one");
  written("world", shared("worlds", "circuit24"));
  written("unknown", "words\n");
  EXPECT_EQ(error("lap one", FileUse::Map),
            lap + ": this is a recording (MCAP), not a tag map. `waymark map '" + lap +
                "'` maps it, `waymark info '" + lap + "'` lists its contents.");
  EXPECT_EQ(error("lap one", FileUse::Recording), "");
  EXPECT_EQ(error("unknown", FileUse::Recording), "") << "its reader reports the error";
  EXPECT_EQ(error("none.mp4", FileUse::Recording), "") << "no such file";
  EXPECT_THAT(described_kind(folder_ / "world"),
              HasSubstr("world is a simulated world. `waymark world check"));
  EXPECT_EQ(described_kind(folder_ / "unknown"), "");

  const auto not_opened = open_recording(folder_ / "world");
  ASSERT_FALSE(not_opened);
  EXPECT_EQ(not_opened.error().code, ErrorCode::Unsupported) << "the code is the one set by the reader";
  EXPECT_THAT(not_opened.error().message, HasSubstr("this is a simulated world, not a recording"));
  const auto several = open_recordings({lap, (folder_ / "world").string()}, {});
  ASSERT_FALSE(several);
  EXPECT_THAT(to_string(several.error()), HasSubstr("world: this is a simulated world"));
}

TEST(FileKindsOfRealData, EachIsRecognised) {
  WAYMARK_REAL_DATA(folder, "wpical");
  const fs::path data = folder.parent_path();
  const std::pair<FileKind, const char*> files[] = {
      {FileKind::Video, "wpical/field.mp4"},
      {FileKind::WpilibLayout, "wpical/2024-crescendo.json"},
      {FileKind::Camera, "photonvision/laptop_1280.json"},
      {FileKind::Camera, "photonvision/limelight_1280_720.json"},
      {FileKind::Packed, "photonvision/lifecam480p.json.gz"},
      {FileKind::Image, "photonvision/robots.jpg"},
      {FileKind::Image, "photonvision/36h11_stress_test.png"},
      {FileKind::LcmLog, "lcm/lcmlog-2024-04-15.00"},
      {FileKind::Points, "lcm/landmarks.csv"},
      {FileKind::Points, "aer1513/landmarks.csv"},
      {FileKind::Packed, "aer1513/measurements.csv.gz"},
      {FileKind::Packed, "euroc-imu-april/imu0.csv.gz"},
      {FileKind::TagslamFolder, "tagslam/test_1"},
      {FileKind::TagslamFolder, "tagslam/test_10"},
      {FileKind::TagslamFile, "tagslam/test_1/config.json"},
      {FileKind::TagslamFile, "tagslam/test_1/camera_poses.yaml"},
      {FileKind::TagslamBodies, "tagslam/test_1/tagslam.yaml"},
      {FileKind::Camera, "tagslam/test_1/cameras.yaml"},
      {FileKind::Packed, "tagslam/test_1/tag_detections.bag.bz2"},
      {FileKind::Table, "tagslam/test_1/ref_static.csv"},
      {FileKind::Path, "paths/ref_sim048.csv"},
      {FileKind::Points, "paths/world_walls_tags_gt.csv"},
      {FileKind::TrueCorners, "synth-tags/clean/truth.csv"},
      {FileKind::Mcap, "mcap-conformance/OneMessage/OneMessage-ch-chx-mx-pad-rch-rsh-st-sum.mcap"},
      {FileKind::Unknown, "mcap-conformance/NoData/NoData.json"},
      {FileKind::Unknown, "README.md"}};
  for (const auto& [kind, file] : files) EXPECT_EQ(kind_of(data / file), kind) << file;
}

}  // namespace
}  // namespace waymark
