#include "waymark/tags/run_components.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace waymark::search {

std::int32_t RunComponents::root(std::int32_t component) {
  while (components_[at(component)].parent != component) {
    std::int32_t& parent = components_[at(component)].parent;
    parent = components_[at(parent)].parent;
    component = parent;
  }
  return component;
}

std::int32_t RunComponents::unite(std::int32_t a, std::int32_t b) {
  if (a > b) std::swap(a, b);
  Component& into = components_[at(a)];
  Component& from = components_[at(b)];
  from.parent = a;
  into.x0 = std::min(into.x0, from.x0);
  into.x1 = std::max(into.x1, from.x1);
  into.y0 = std::min(into.y0, from.y0);
  into.y1 = std::max(into.y1, from.y1);
  into.area += from.area;
  into.run_count += from.run_count;
  runs_[at(into.last)].next = from.first;
  into.last = from.last;
  return a;
}

void RunComponents::find_edges(const BitPlane& plane, int y) {
  edges_.clear();
  const std::uint64_t* words = plane.row(y);
  std::uint64_t carry = 0;
  for (std::size_t i = 0; i < plane.words_a_row; ++i) {
    const std::uint64_t word = words[i];
    std::uint64_t changes = word ^ ((word << 1U) | carry);
    carry = word >> 63U;
    while (changes != 0) {
      edges_.push_back(static_cast<std::int16_t>(static_cast<int>(64 * i) + std::countr_zero(changes)));
      changes &= changes - 1;
    }
  }
  if (carry != 0) edges_.push_back(static_cast<std::int16_t>(plane.width));
}

void RunComponents::add_run(std::int16_t x0, std::int16_t x1, int y, PreviousRow& above,
                            std::int32_t end_above) {
  const auto id = static_cast<std::int32_t>(runs_.size());
  while (above.begin < end_above && runs_[at(above.begin)].x1 < x0) ++above.begin;
  std::int32_t mine = -1;
  std::int32_t other = above.begin;
  for (; other < end_above && runs_[at(other)].x0 <= x1; ++other) {
    const Run& run = runs_[at(other)];
    if (run.x1 == x0 || run.x0 == x1) {
      diagonals_.emplace_back(other, id);
      continue;
    }
    const std::int32_t theirs = root(run.component);
    mine = mine < 0 ? theirs : (theirs == mine ? mine : unite(mine, theirs));
  }
  if (other > above.begin) above.begin = other - 1;  // the last one may touch the next run too
  const auto row = static_cast<std::int16_t>(y);
  const auto next_row = static_cast<std::int16_t>(y + 1);
  if (mine < 0) {
    mine = static_cast<std::int32_t>(components_.size());
    components_.push_back({mine, x0, x1, row, next_row, x1 - x0, 1, id, id, false});
  } else {
    Component& component = components_[at(mine)];
    component.x0 = std::min(component.x0, x0);
    component.x1 = std::max(component.x1, x1);
    component.y1 = next_row;
    component.area += x1 - x0;
    ++component.run_count;
    runs_[at(component.last)].next = id;
    component.last = id;
  }
  runs_.push_back({x0, x1, row, -1, mine});
}

void RunComponents::label(const BitPlane& plane) {
  runs_.clear();
  components_.clear();
  diagonals_.clear();
  PreviousRow above;
  for (int y = 0; y < plane.height; ++y) {
    find_edges(plane, y);
    const auto begin = static_cast<std::int32_t>(runs_.size());
    const std::int32_t end_above = above.end;
    for (std::size_t k = 0; k + 1 < edges_.size(); k += 2)
      add_run(edges_[k], edges_[k + 1], y, above, end_above);
    above = {begin, static_cast<std::int32_t>(runs_.size())};
  }
}

void RunComponents::join_diagonals() {
  for (const auto& [a, b] : diagonals_) {
    const std::int32_t one = root(runs_[at(a)].component);
    const std::int32_t two = root(runs_[at(b)].component);
    if (one != two) components_[at(unite(one, two))].joined_diagonally = true;
  }
}

}  // namespace waymark::search
