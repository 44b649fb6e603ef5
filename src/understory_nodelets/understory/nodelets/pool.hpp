// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Buffers that come back once all their readers have let go of them, so that images and clouds of
// megabytes are allocated once and not per frame. One thread takes; readers may be on any.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include <boost/shared_ptr.hpp>

namespace understory {

// roscpp's kind of pointer to the same object.
template <class Message>
[[nodiscard]] boost::shared_ptr<const Message> to_boost(std::shared_ptr<const Message> message) {
  const Message* address = message.get();
  return {address, [held = std::move(message)](const Message* /*same*/) mutable { held.reset(); }};
}

template <class Buffer>
class Pool {
 public:
  // As its last user left it. Nobody else holds it.
  [[nodiscard]] std::shared_ptr<Buffer> take() {
    for (const std::shared_ptr<Buffer>& buffer : buffers_) {
      if (buffer.use_count() == 1) {
        std::atomic_thread_fence(std::memory_order_acquire);  // after its last reader's release
        return buffer;
      }
    }
    buffers_.push_back(std::make_shared<Buffer>());
    return buffers_.back();
  }

 private:
  std::vector<std::shared_ptr<Buffer>> buffers_;  // as many as were ever in use at once
};

}  // namespace understory
