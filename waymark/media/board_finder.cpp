#include "waymark/media/board_finder.hpp"

#include "waymark/modules/load_module.hpp"

namespace waymark {

Result<BoardFinder> BoardFinder::load() {
  const auto symbol = load_module({.file = "libwaymark-boards.so",
                                   .symbol = kBoardFinderSymbol,
                                   .purpose = "calibration boards",
                                   .needs = "libopencv-contrib406 and libopencv-calib3d406 (OpenCV)",
                                   .build = "libopencv-contrib-dev and libopencv-calib3d-dev"});
  if (!symbol) return tl::unexpected(symbol.error());
  Functions functions;
  reinterpret_cast<void (*)(Functions&)>(*symbol)(functions);
  return BoardFinder(functions);
}

Result<FoundBoard> BoardFinder::find(const ImageView& image, const CalibrationBoard& board) const {
  if (Status usable = check_board(board); !usable) return tl::unexpected(usable.error());
  FoundBoard found;
  Error error;
  functions_.find(image, board, found, error);
  if (!error.message.empty()) return tl::unexpected(error);
  return found;
}

Result<std::string> BoardFinder::name_markers(const ImageView& image) const {
  std::string name;
  Error error;
  functions_.name_markers(image, name, error);
  if (!error.message.empty()) return tl::unexpected(error);
  return name;
}

Result<MarkerCells> BoardFinder::marker(const std::string& dictionary, int number) const {
  MarkerCells cells;
  Error error;
  functions_.marker(dictionary, number, cells, error);
  if (!error.message.empty()) return tl::unexpected(error);
  return cells;
}

}  // namespace waymark
