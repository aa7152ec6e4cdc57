// The only symbol exported by the module libwaymark-boards.so.
#include <exception>
#include <string>
#include <utility>

#include "waymark/media/opencv/find_board.hpp"

namespace {

/// OpenCV reports errors as exceptions, which must not cross the module boundary.
template <class Value, class Call>
void call(const Call& made, Value& value, waymark::Error& error) {
  try {
    auto result = made();
    if (result)
      value = std::move(*result);
    else
      error = result.error();
  } catch (const std::exception& thrown) {
    error = {waymark::ErrorCode::InvalidArgument, std::string("OpenCV: ") + thrown.what(), {}, {}};
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void waymark_board_finder(
    waymark::BoardFinder::Functions& functions) {
  functions.find = [](const waymark::ImageView& image, const waymark::CalibrationBoard& board,
                      waymark::FoundBoard& found, waymark::Error& error) {
    call([&] { return waymark::find_board(image, board); }, found, error);
  };
  functions.marker = [](const std::string& dictionary, int number, waymark::MarkerCells& cells,
                        waymark::Error& error) {
    call([&] { return waymark::marker_cells(dictionary, number); }, cells, error);
  };
  functions.name_markers = [](const waymark::ImageView& image, std::string& name, waymark::Error& error) {
    call([&] { return waymark::Result<std::string>(waymark::name_markers(image)); }, name, error);
  };
}
