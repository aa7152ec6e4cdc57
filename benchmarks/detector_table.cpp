// Detection rate and cost of detectors in one run: rendered sets with ground truth, photographs, images
// without tags. One JSON object per line and detector; tools/detector_table.py makes
// docs/results/detection.md from them.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tests/support/degraded_tags.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/detector/waymark_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

#ifdef WAYMARK_OPENCV_ARUCO
#include <opencv2/aruco.hpp>
#endif

namespace waymark {
namespace {

using testing::TagImage;

struct Peer {
  std::string name;
  std::function<std::vector<TagDetection>(const Image&)> detect;
};

struct Flags {
  std::optional<std::filesystem::path> data;
  std::optional<std::filesystem::path> tag_free;  ///< a folder of images without tags
  std::uint64_t seed = testing::kSetSeed;
  std::vector<std::string> sets;
  std::vector<std::string> only;  ///< parts of detectors' names; empty: all
  int repeats = 5;
};

Peer peer_of(std::string name, Result<std::unique_ptr<Detector>> made) {
  std::shared_ptr<Detector> detector = std::move(made).value();
  return {std::move(name), [detector](const Image& image) { return detector->detect(image).value(); }};
}

Peer refined_peer_of(std::string name, Result<std::unique_ptr<Detector>> made) {
  const auto finder = std::make_shared<TagFinder>(make_tag_finder(std::move(made).value()).value());
  return {std::move(name), [finder](const Image& image) {
            return find_tags(image, *finder, ImageLens::unknown()).value().detections;
          }};
}

/// libapriltag with its own settings except the given ones.
DetectorOptions library(double decimate, int min_white_black_diff) {
  DetectorOptions options;
  options.max_hamming = 2;
  options.decode_sharpening = 0.25;
  options.min_white_black_diff = min_white_black_diff;
  options.quad_decimate = decimate;
  return options;
}

#ifdef WAYMARK_OPENCV_ARUCO
/// OpenCV's pixel centres start at 0, and the corners of its AprilTag dictionaries at BR.
std::vector<TagDetection> detect_aruco(const Image& image) {
  static const cv::Ptr<cv::aruco::Dictionary> dictionary =
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  const cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  const cv::Mat view(image.height(), image.width(), CV_8U, const_cast<std::uint8_t*>(image.row(0)));
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(view, dictionary, corners, ids, parameters);
  std::vector<TagDetection> detections(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    detections[i].tag.number = ids[i];
    for (std::size_t k = 0; k < 4; ++k) {
      const cv::Point2f& corner = corners[i][(k + 2) % 4];
      detections[i].corners_px.at(k) = {corner.x + 0.5, corner.y + 0.5};
    }
  }
  return detections;
}
#endif

std::vector<Peer> peers() {
  std::vector<Peer> all;
  DetectorOptions ours;
  ours.max_hamming = 2;
  all.push_back(peer_of("waymark", make_waymark_detector(ours)));
  DetectorOptions quick = ours;
  quick.min_white_black_diff = 30;
  all.push_back(peer_of("waymark, min_white_black_diff 30", make_waymark_detector(quick)));
  all.push_back(refined_peer_of("waymark, refined", make_waymark_detector(ours)));
  ours.find_inverted = true;
  all.push_back(peer_of("waymark, find_inverted", make_waymark_detector(ours)));
  all.push_back(refined_peer_of("apriltag3, as set here, refined", make_apriltag_detector()));
  all.push_back(peer_of("AprilTag 3.3.0, decimate 1", make_apriltag_detector(library(1, 5))));
  all.push_back(
      peer_of("AprilTag 3.3.0, decimate 1, min_white_black_diff 20", make_apriltag_detector(library(1, 20))));
  all.push_back(peer_of("AprilTag 3.3.0, decimate 2", make_apriltag_detector(library(2, 5))));
#ifdef WAYMARK_OPENCV_ARUCO
  cv::setNumThreads(1);
  all.push_back({"OpenCV 4.6.0 ArUco, subpixel corners", detect_aruco});
#endif
  return all;
}

double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Results of one detector on one set.
struct Tally {
  std::vector<ImageDetections> answers;
  std::vector<double> ms;  ///< minimum processor time of each image
};

void add(Tally& tally, const Peer& peer, const Image& image, const std::vector<TrueTag>& truth, int repeats) {
  double least = std::numeric_limits<double>::infinity();
  std::vector<TagDetection> found;
  for (int i = 0; i < repeats; ++i) {
    const double begin = processor_ms();
    found = peer.detect(image);
    least = std::min(least, processor_ms() - begin);
  }
  tally.ms.push_back(least);
  tally.answers.push_back({std::move(found), truth});
}

/// "found/truth" of each class, one row per size.
std::string classes(const DetectionScores& scores) {
  std::string rows;
  for (const auto& by_tilt : scores.by_size_and_tilt) {
    std::string row;
    for (const ClassScores& one : by_tilt)
      row += fmt::format("{}[{},{}]", row.empty() ? "" : ",", one.found, one.truth);
    rows += fmt::format("{}[{}]", rows.empty() ? "" : ",", row);
  }
  return rows;
}

void print(std::string_view set, const Peer& peer, const Tally& tally, bool with_classes) {
  const DetectionScores scores = score_detections(tally.answers);
  std::cout << fmt::format(
      R"({{"set":"{}","detector":"{}","images":{},"tags":{},"correct":{},"wrong_ids":{},"false_positives":{},"corner_rmse_px":{:.3f},"ms_median":{:.3f},"ms_p90":{:.3f},"ms_worst":{:.3f})",
      set, peer.name, scores.images, scores.truth, scores.correct, scores.wrong_ids, scores.false_positives,
      scores.corners ? scores.corners->rmse_px : 0, quantile(tally.ms, 0.5), quantile(tally.ms, 0.9),
      quantile(tally.ms, 1));
  if (with_classes) std::cout << R"(,"classes":[)" << classes(scores) << "]";
  std::cout << "}" << std::endl;
}

/// Lines of (set, detector) from images that are generated or read one by one.
void measure(const std::string& set, std::size_t images, const std::function<TagImage(std::size_t)>& image_at,
             const Flags& flags, bool with_classes = false) {
  const bool wanted = flags.sets.empty() || std::ranges::find(flags.sets, set) != flags.sets.end();
  if (!wanted) return;
  std::vector<Peer> all = peers();
  std::erase_if(all, [&](const Peer& peer) {
    const auto named = [&](const std::string& part) { return peer.name.find(part) != std::string::npos; };
    return !flags.only.empty() && std::ranges::none_of(flags.only, named);
  });
  std::vector<Tally> tallies(all.size());
  for (std::size_t i = 0; i < images; ++i) {
    const TagImage one = image_at(i);
    for (std::size_t k = 0; k < all.size(); ++k) add(tallies[k], all[k], one.image, one.truth, flags.repeats);
  }
  for (std::size_t k = 0; k < all.size(); ++k) print(set, all[k], tallies[k], with_classes);
}

void measure_clean(const std::filesystem::path& folder, const Flags& flags) {
  std::ifstream file(folder / "truth.csv");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const DetectionTruth truth = parse_truth(text, "truth.csv").value();
  const std::vector<std::pair<std::string, std::vector<TrueTag>>> list(truth.begin(), truth.end());
  measure(
      "clean", list.size(),
      [&](std::size_t i) {
        return TagImage{list[i].first, read_image(folder / (list[i].first + ".png")).value(), list[i].second};
      },
      flags, true);
}

/// Photographs have no ground truth: counts detections and measures the time.
void measure_photographs(const std::filesystem::path& folder, const Flags& flags) {
  std::vector<Image> photographs;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto suffix = entry.path().extension();
    if (suffix != ".png" && suffix != ".jpg") continue;
    Image image = read_image(entry.path()).value();
    if (image.width() == 1280 && image.height() == 720) photographs.push_back(std::move(image));
  }
  measure(
      "photographs 1280x720", photographs.size(),
      [&](std::size_t i) {
        return TagImage{"photograph", photographs[i], {}};
      },
      flags);
}

constexpr std::string_view kWithTags = "tags on photographs";
constexpr int kPhotographsWithTags = 40;

/// All detections in images without tags are false. Skips images larger than detectors accept. Also measures
/// the first photographs with rendered tags over them.
void measure_tag_free(const std::filesystem::path& folder, const Flags& flags) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const auto suffix = entry.path().extension();
    if (entry.is_regular_file() && !entry.is_symlink() && (suffix == ".png" || suffix == ".jpg"))
      files.push_back(entry.path());
  }
  std::ranges::sort(files);
  double megapixels = 0;
  const auto image_at = [&](std::size_t i) {
    auto image = read_image(files[i]);
    if (!image) return TagImage{files[i].string(), Image(1, 1), {}};
    megapixels += 1e-6 * image->width() * image->height();
    return TagImage{files[i].string(), std::move(*image), {}};
  };
  measure("tag-free photographs", files.size(), image_at, flags);
  std::vector<TagImage> with_tags;
  const bool wanted = flags.sets.empty() || std::ranges::find(flags.sets, kWithTags) != flags.sets.end();
  for (std::size_t i = 0; wanted && i < files.size() && std::ssize(with_tags) < kPhotographsWithTags; ++i) {
    const auto image = read_image(files[i]);
    if (!image || image->width() < 1280 || image->height() < 720) continue;
    with_tags.push_back(testing::tags_on_photograph(*image, i, flags.seed));
  }
  measure(
      std::string(kWithTags), with_tags.size(), [&](std::size_t i) { return with_tags[i]; }, flags);
  std::cerr << fmt::format("tag-free photographs: {:.0f} megapixels\n", megapixels);
}

std::vector<std::string> split(std::string_view list) {
  std::vector<std::string> words;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    words.emplace_back(list.substr(0, comma));
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return words;
}

}  // namespace
}  // namespace waymark

/// detector_table [--data FOLDER] [--tag-free FOLDER] [--seed N] [--sets NAME,…] [--only PART OF A NAME,…]
/// [--repeats N] [--draw FOLDER]
int main(int count, char** words) {
  using namespace waymark;
  Flags flags;
  std::filesystem::path draw;
  for (int i = 1; i + 1 < count; i += 2) {
    const std::string_view flag = words[i];
    const std::string value = words[i + 1];
    if (flag == "--data") flags.data = value;
    if (flag == "--tag-free") flags.tag_free = value;
    if (flag == "--seed") flags.seed = std::stoull(value);
    if (flag == "--sets") flags.sets = split(value);
    if (flag == "--only") flags.only = split(value);
    if (flag == "--repeats") flags.repeats = std::stoi(value);
    if (flag == "--draw") draw = value;
  }
  if (!draw.empty()) {  // one image of each set, for inspection
    for (const testing::TagSet& set : testing::tag_sets()) {
      const auto path = draw / (std::string(set.name) + ".png");
      if (!write_image(path, testing::tag_image(set.name, 1, flags.seed).image)) return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
  }
  for (const testing::TagSet& set : testing::tag_sets()) {
    measure(
        std::string(set.name), set.images,
        [&](std::size_t i) { return testing::tag_image(set.name, i, flags.seed); }, flags);
  }
  constexpr std::size_t kTagFree = 40;
  measure(
      "tag free", kTagFree,
      [&](std::size_t i) {
        return TagImage{"clutter", testing::tag_free_image(i, flags.seed), {}};
      },
      flags);
  if (flags.data) {
    measure_clean(*flags.data / "synth-tags/clean", flags);
    measure_photographs(*flags.data / "photonvision", flags);
  }
  if (flags.tag_free) measure_tag_free(*flags.tag_free, flags);
  return EXIT_SUCCESS;
}
