// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Result<T, E>: a value, or the reason why there is none. For what may fail in flight; what is
// wrong at start is an exception. Reading the side that is not there is a bug (assert).
#pragma once

#include <cassert>
#include <utility>
#include <variant>

namespace understory {

template <class T, class E>
class [[nodiscard]] Result {
 public:
  // Implicit, so that functions return the value or the reason as such.
  // NOLINTNEXTLINE(google-explicit-constructor)
  Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  Result(E error) : content_(std::in_place_index<1>, std::move(error)) {}

  [[nodiscard]] bool has_value() const { return content_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  [[nodiscard]] const T& value() const& {
    assert(has_value());
    return *std::get_if<0>(&content_);
  }
  [[nodiscard]] T&& value() && {
    assert(has_value());
    return std::move(*std::get_if<0>(&content_));
  }
  [[nodiscard]] const E& error() const {
    assert(!has_value());
    return *std::get_if<1>(&content_);
  }

  const T& operator*() const& { return value(); }
  const T* operator->() const { return &value(); }

 private:
  std::variant<T, E> content_;
};

}  // namespace understory
