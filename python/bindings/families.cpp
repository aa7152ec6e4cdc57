#include "waymark/families/family.hpp"

#include <string>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/errors.hpp"
#include "python/bindings/jobs.hpp"
#include "python/bindings/rooms.hpp"
#include "waymark/families/hamming.hpp"

namespace waymark::python {
namespace {

/// Returns a code of a family; raises InvalidArgument if it has more bits than the family.
std::uint64_t code_of(const Family& family, std::uint64_t code, const char* name) {
  const std::size_t bits = family.bits.size();
  if (bits < 64 && (code >> bits) != 0)
    refuse(name, fmt::format("{:#x} has more than the {} bits of {}", code, bits, family.name));
  return code;
}

FamilyId family_named(const std::string& name) { return value_of(parse_family(name)); }

py::dict layout(const std::string& name) {
  const Family& found = family(family_named(name));
  py::list bits;
  for (const BitCell& cell : found.bits) bits.append(py::make_tuple(cell.x, cell.y));
  py::dict answer;
  answer["name"] = found.name;
  answer["width_at_border"] = found.width_at_border;
  answer["total_width"] = found.total_width;
  answer["reversed_border"] = found.reversed_border;
  answer["min_hamming"] = found.min_hamming;
  answer["bits"] = bits;
  answer["codes"] =
      py::array_t<std::uint64_t>(static_cast<py::ssize_t>(found.codes.size()), found.codes.data());
  return answer;
}

py::array_t<std::uint8_t> bitmap_of(const std::string& tag) {
  const TagId id = value_of(parse_tag_id(tag));
  const auto cells = bitmap(id);
  const int width = family(id.family).total_width;
  return py::array_t<std::uint8_t>({width, width}, cells.data());
}

std::vector<std::string> family_names() {
  std::vector<std::string> names;
  for (const FamilyId id : kAllFamilies) names.emplace_back(to_string(id));
  return names;
}

}  // namespace

void bind_families(py::module_& m) {
  m.doc() = "Tag families of AprilTag 3: bit layout, codes, bitmaps and Hamming distances under rotation.";
  m.def("names", &family_names, "Names of the nine families.");
  m.def("family", &layout, py::arg("name"),
        "Layout and codes of a family as a dictionary: width_at_border and total_width [cells], bits [(x, y) "
        "of each data bit, most "
        "significant first], codes (n,) uint64, min_hamming, reversed_border.");
  m.def("bitmap", &bitmap_of, py::arg("tag"),
        "The printed tag, such as 'tag36h11:7': (cells, cells) uint8, 0 black, 255 white, 128 not part of "
        "the tag.");
  m.def("hamming_distance", &hamming_distance, py::arg("a"), py::arg("b"),
        "Number of differing bits of two codes.");
  m.def(
      "turned",
      [](const std::string& name, std::uint64_t code, int quarter_turns) {
        const Family& found = family(family_named(name));
        return CodeRotation(found).turned(code_of(found, code, "code"), quarter_turns);
      },
      py::arg("family"), py::arg("code"), py::arg("quarter_turns"),
      "The code read from a printed tag that is rotated clockwise by quarter_turns * 90 degrees.");
  m.def(
      "min_rotational_distance",
      [](const std::string& name, std::uint64_t a, std::uint64_t b) {
        const Family& found = family(family_named(name));
        return CodeRotation(found).min_rotational_distance(code_of(found, a, "a"), code_of(found, b, "b"));
      },
      py::arg("family"), py::arg("a"), py::arg("b"),
      "Smallest Hamming distance between `a` and the four rotations of `b`.");
  m.def(
      "minimum_distance",
      [](const std::string& name) {
        const Family& found = family(family_named(name));
        PythonJob control(py::none{});
        int distance = 0;
        {
          const py::gil_scoped_release release;
          distance = minimum_distance(found, control.control().cancelled);
        }
        control.rethrow();
        return distance;
      },
      py::arg("family"),
      "Smallest Hamming distance between two codes of the family over all rotations; takes seconds for "
      "the largest families.");
}

}  // namespace waymark::python
