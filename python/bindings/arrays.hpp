#pragma once

#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <Eigen/Core>

#include "waymark/image/image.hpp"

namespace waymark::python {

namespace py = pybind11;

/// Row-major contiguous float64. Refers to the caller's memory if it already has this layout.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The values that an array may contain.
enum class Numbers { Finite, Any };

/// An argument as float64 with this shape (-1: any length). Raises InvalidArgument with the name of the
/// argument if it is not an array of real numbers, has a different shape, or, unless Any, is not finite.
[[nodiscard]] Doubles doubles(const py::handle& value, const char* name,
                              const std::vector<py::ssize_t>& shape, Numbers numbers = Numbers::Finite);

/// Returns the number passed as an argument or attribute; raises InvalidArgument if it is not finite.
double finite(double number, const char* name);

/// A view of a grey image, shape (height, width), uint8. Rows may be padded, but the pixels in a row must be
/// contiguous. The array must outlive the view. Raises InvalidArgument with a hint for anything else.
[[nodiscard]] ImageView image_view(const py::handle& value, const char* name = "image");

/// A NumPy array (height, width) of uint8 that takes ownership of the image without a copy.
[[nodiscard]] py::array_t<std::uint8_t> to_array(Image image);

/// A matrix of finite values from an argument with exactly this shape.
template <int Rows, int Columns>
[[nodiscard]] Eigen::Matrix<double, Rows, Columns> matrix_of(const py::handle& value, const char* name) {
  using RowMajor = Eigen::Matrix<double, Rows, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
  const Doubles numbers = Columns == 1 ? doubles(value, name, {Rows}) : doubles(value, name, {Rows, Columns});
  return Eigen::Map<const RowMajor>(numbers.data());
}

/// A copy as a NumPy array: (n,) for a vector, (rows, columns) for a matrix.
template <class Derived>
[[nodiscard]] py::array_t<double> to_array(const Eigen::MatrixBase<Derived>& matrix) {
  std::vector<py::ssize_t> shape{matrix.rows()};
  if constexpr (Derived::ColsAtCompileTime != 1) shape.push_back(matrix.cols());
  py::array_t<double> array(shape);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

/// Like to_array(), but always with shape (rows, columns), even for one element.
template <class Derived>
[[nodiscard]] py::array_t<double> to_table(const Eigen::MatrixBase<Derived>& matrix) {
  const py::array_t<double> array = to_array(matrix);
  return array.ndim() == 2 ? array : py::array_t<double>(array.attr("reshape")(matrix.rows(), matrix.cols()));
}

/// Applies a function to a vector (n,) or to each row of (rows, n). `call(in, out)` receives pointers to n
/// and `width` doubles. Returns (width,) or (rows, width).
template <class Call>
[[nodiscard]] py::array_t<double> each_row(const py::handle& value, const char* name, py::ssize_t n,
                                           py::ssize_t width, Call&& call) {
  const py::object given = py::reinterpret_borrow<py::object>(value);
  const bool single = py::isinstance<py::array>(given) ? py::cast<py::array>(given).ndim() == 1
                                                       : Doubles::ensure(given) && Doubles(given).ndim() == 1;
  const Doubles in =
      single ? doubles(value, name, {n}, Numbers::Any) : doubles(value, name, {-1, n}, Numbers::Any);
  const py::ssize_t rows = single ? 1 : in.shape(0);
  py::array_t<double> out(single ? std::vector<py::ssize_t>{width} : std::vector<py::ssize_t>{rows, width});
  const double* from = in.data();
  double* to = out.mutable_data();
  for (py::ssize_t row = 0; row < rows; ++row) call(from + row * n, to + row * width);
  return out;
}

}  // namespace waymark::python
