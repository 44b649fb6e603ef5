// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A queue of a fixed size, allocated once. Not thread-safe.
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

namespace understory::can {

template <class T>
class FixedRing {
 public:
  explicit FixedRing(std::size_t capacity) : items_(capacity) { assert(capacity > 0); }

  [[nodiscard]] bool is_empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const T& front() const {
    assert(size_ > 0);
    return items_[begin_];
  }
  // False: full.
  [[nodiscard]] bool push(const T& item) {
    if (size_ == items_.size()) {
      return false;
    }
    items_[(begin_ + size_) % items_.size()] = item;
    ++size_;
    return true;
  }
  void pop() {
    assert(size_ > 0);
    begin_ = (begin_ + 1) % items_.size();
    --size_;
  }
  void clear() { size_ = 0; }

 private:
  std::vector<T> items_;
  std::size_t begin_ = 0;
  std::size_t size_ = 0;
};

}  // namespace understory::can
