#pragma once

#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <Eigen/Core>

#include "waymark/image/image.hpp"

namespace waymark::python {

namespace py = pybind11;

/// Numbers in rows, float64 without gaps: the caller's own memory where it is that already.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Which numbers an array may hold.
enum class Numbers { Finite, Any };

/// An argument as float64 of this shape (-1: any length). Raises InvalidArgument, which names the argument,
/// for what is no array of real numbers, for another shape, and for NaN or infinity unless Any.
[[nodiscard]] Doubles doubles(const py::handle& value, const char* name,
                              const std::vector<py::ssize_t>& shape, Numbers numbers = Numbers::Finite);

/// A number of an argument or attribute, which must be finite; else raises InvalidArgument.
double finite(double number, const char* name);

/// A grey picture of Python, shape (height, width), uint8, where it lies: rows may have gaps, pixels of a row
/// may not. The array must be kept meanwhile. Raises InvalidArgument for anything else, with what to do.
[[nodiscard]] ImageView image_view(const py::handle& value, const char* name = "image");

/// The picture as a NumPy array (height, width) of uint8 that owns it: nothing is copied.
[[nodiscard]] py::array_t<std::uint8_t> to_array(Image image);

/// A matrix from an argument of that very shape, finite numbers.
template <int Rows, int Columns>
[[nodiscard]] Eigen::Matrix<double, Rows, Columns> matrix_of(const py::handle& value, const char* name) {
  using RowMajor = Eigen::Matrix<double, Rows, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
  const Doubles numbers = Columns == 1 ? doubles(value, name, {Rows}) : doubles(value, name, {Rows, Columns});
  return Eigen::Map<const RowMajor>(numbers.data());
}

/// A copy as NumPy array: (n,) of a vector, (rows, columns) of a matrix.
template <class Derived>
[[nodiscard]] py::array_t<double> to_array(const Eigen::MatrixBase<Derived>& matrix) {
  std::vector<py::ssize_t> shape{matrix.rows()};
  if constexpr (Derived::ColsAtCompileTime != 1) shape.push_back(matrix.cols());
  py::array_t<double> array(shape);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

/// The same, always (rows, columns): also of one number.
template <class Derived>
[[nodiscard]] py::array_t<double> to_table(const Eigen::MatrixBase<Derived>& matrix) {
  const py::array_t<double> array = to_array(matrix);
  return array.ndim() == 2 ? array : py::array_t<double>(array.attr("reshape")(matrix.rows(), matrix.cols()));
}

/// Applies a function to a vector (n,) or to each row of (rows, n): `call(in, out)` has pointers to n and
/// `width` numbers. Gives (width,) or (rows, width).
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
