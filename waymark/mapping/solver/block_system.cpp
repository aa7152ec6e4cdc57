#include "waymark/mapping/solver/block_system.hpp"

#include <algorithm>
#include <utility>

namespace waymark::internal {

BlockSystem::BlockSystem(std::vector<int> dimensions, std::vector<std::pair<int, int>> couplings)
    : dimensions_(std::move(dimensions)) {
  const int unknowns = static_cast<int>(dimensions_.size());
  int scalars = 0;
  for (int d : dimensions_) {
    offsets_.push_back(scalars);
    scalars += d;
  }
  for (auto& [a, b] : couplings) {
    if (a < b) std::swap(a, b);  // ensures row >= column (lower triangle)
    std::swap(a, b);             // sort by column first
  }
  for (int i = 0; i < unknowns; ++i) couplings.emplace_back(i, i);
  std::ranges::sort(couplings);
  couplings.erase(std::ranges::unique(couplings).begin(), couplings.end());

  first_.assign(static_cast<std::size_t>(unknowns) + 1, 0);
  std::vector<int> heights(static_cast<std::size_t>(unknowns), 0);
  for (const auto& [column, row] : couplings) {
    ++first_[static_cast<std::size_t>(column) + 1];
    int& height = heights[static_cast<std::size_t>(column)];
    rows_.emplace_back(row, height);
    height += dimension(row);
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];

  // Diagonal blocks are stored in full so that all blocks have the same layout; the factorisation does not
  // read their upper halves.
  H_.resize(scalars, scalars);
  int entries = 0;
  for (int c = 0; c < unknowns; ++c) {
    for (int k = 0; k < dimension(c); ++k) {
      H_.outerIndexPtr()[offset(c) + k] = entries;
      entries += heights[static_cast<std::size_t>(c)];
    }
  }
  H_.outerIndexPtr()[scalars] = entries;
  H_.resizeNonZeros(entries);
  for (int c = 0; c < unknowns; ++c) {
    for (int k = 0; k < dimension(c); ++k) {
      int* inner = H_.innerIndexPtr() + H_.outerIndexPtr()[offset(c) + k];
      for (int at = first_[static_cast<std::size_t>(c)]; at < first_[static_cast<std::size_t>(c) + 1]; ++at) {
        const int row = rows_[static_cast<std::size_t>(at)].first;
        for (int i = 0; i < dimension(row); ++i) *inner++ = offset(row) + i;
      }
    }
  }
  gradient_.resize(scalars);
  clear();
}

void BlockSystem::clear() {
  std::fill_n(H_.valuePtr(), H_.nonZeros(), 0.0);
  gradient_.setZero();
}

int BlockSystem::place(int row, int column) const {
  const auto begin = rows_.begin() + first_[static_cast<std::size_t>(column)];
  const auto end = rows_.begin() + first_[static_cast<std::size_t>(column) + 1];
  return std::ranges::lower_bound(begin, end, row, {}, &std::pair<int, int>::first)->second;
}

void BlockSystem::add(std::span<const Part> parts, const Eigen::Ref<const Eigen::VectorXd>& r,
                      double weight) {
  for (const Part& column : parts) {
    if (column.unknown < 0) continue;
    gradient_.segment(offset(column.unknown), dimension(column.unknown)).noalias() +=
        weight * column.J.transpose() * r;
    for (const Part& row : parts) {
      if (row.unknown < column.unknown) continue;
      const int start = place(row.unknown, column.unknown);
      const int column_offset = offset(column.unknown);
      for (int k = 0; k < dimension(column.unknown); ++k) {
        double* values = H_.valuePtr() + H_.outerIndexPtr()[column_offset + k] + start;
        for (int i = 0; i < dimension(row.unknown); ++i)
          values[i] += weight * row.J.col(i).dot(column.J.col(k));
      }
    }
  }
}

void BlockSystem::add_to_block(int row, int column, const Matrix6& M) {
  const auto [early, late] = std::minmax(row, column);
  const int first = H_.outerIndexPtr()[offset(early)];
  const int stride = H_.outerIndexPtr()[offset(early) + 1] - first;
  Eigen::Map<Matrix6, 0, Eigen::OuterStride<>> block(H_.valuePtr() + first + place(late, early),
                                                     Eigen::OuterStride<>(stride));
  if (row >= column)
    block += M;
  else
    block += M.transpose();
}

void BlockSystem::add_corners(const std::array<int, 4>& unknowns,
                              const std::array<const Eigen::Matrix<double, 8, 6>*, 4>& J,
                              const Eigen::Matrix<double, 8, 1>& r, double weight) {
  const auto& [rig, cam, body, tag] = unknowns;
  const bool mirrored = rig >= 0 && body >= 0;
  const auto add = [&](int row, int column, const Matrix6& M) {
    add_to_block(row, column, M);
    if (row == column) add_to_block(row, column, M.transpose());  // the same unknown in two roles
  };
  for (std::size_t c = 0; c < 4; ++c) {
    if (unknowns[c] < 0 || (c == 2 && mirrored)) continue;
    const Eigen::Matrix<double, 8, 6> weighted = weight * *J[c];
    const Eigen::Matrix<double, 6, 1> g = weighted.transpose().lazyProduct(r);
    gradient_.segment<6>(offset(unknowns[c])) += g;
    if (c == 0 && mirrored) gradient_.segment<6>(offset(body)) -= g;
    for (std::size_t k = c; k < 4; ++k) {
      if (unknowns[k] < 0 || (k == 2 && mirrored)) continue;
      // A sum of scaled columns fills vector registers; dot products of short columns do not.
      const Eigen::Matrix<double, 6, 8> Jt = J[k]->transpose();
      const Matrix6 M = Jt.lazyProduct(weighted);
      if (k == c)
        add_to_block(unknowns[k], unknowns[c], M);
      else
        add(unknowns[k], unknowns[c], M);
      if (!mirrored || c != 0) continue;
      add(unknowns[k], body, -M);
      if (k == 0) add_to_block(body, body, M);
    }
  }
}

void BlockSystem::add_corner_size(const std::array<int, 4>& unknowns,
                                  const std::array<const Eigen::Matrix<double, 8, 6>*, 4>& J, int size,
                                  const Eigen::Matrix<double, 8, 1>& J_size,
                                  const Eigen::Matrix<double, 8, 1>& r, double weight) {
  const Eigen::Matrix<double, 8, 1> weighted = weight * J_size;
  gradient_[offset(size)] += weighted.dot(r);
  H_.valuePtr()[H_.outerIndexPtr()[offset(size)] + place(size, size)] += weighted.dot(J_size);
  const bool mirrored = unknowns[0] >= 0 && unknowns[2] >= 0;
  for (std::size_t k = 0; k < 4; ++k) {
    if (unknowns[k] < 0) continue;
    const bool is_mirror = k == 2 && mirrored;
    const Eigen::Matrix<double, 8, 6>& J_pose = is_mirror ? *J[0] : *J[k];
    Eigen::Matrix<double, 6, 1> column = J_pose.transpose().lazyProduct(weighted);
    if (is_mirror) column = -column;
    const auto [early, late] = std::minmax(unknowns[k], size);
    const int first = H_.outerIndexPtr()[offset(early)];
    const int stride = size == late ? H_.outerIndexPtr()[offset(early) + 1] - first : 1;
    double* values = H_.valuePtr() + first + place(late, early);
    for (int i = 0; i < 6; ++i) values[i * stride] += column[i];
  }
}

BlockSystem::Block BlockSystem::at_place(int row, int column, int start) const {
  const int first = H_.outerIndexPtr()[offset(column)];
  return {H_.valuePtr() + first + start, dimension(row), dimension(column),
          Eigen::OuterStride<>(H_.outerIndexPtr()[offset(column) + 1] - first)};
}

std::optional<BlockSystem::Block> BlockSystem::block(int row, int column) const {
  const auto begin = rows_.begin() + first_[static_cast<std::size_t>(column)];
  const auto end = rows_.begin() + first_[static_cast<std::size_t>(column) + 1];
  const auto found = std::ranges::lower_bound(begin, end, row, {}, &std::pair<int, int>::first);
  if (found == end || found->first != row) return std::nullopt;
  return at_place(row, column, found->second);
}

}  // namespace waymark::internal
