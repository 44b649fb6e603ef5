// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/can/bus_load.hpp"

#include <algorithm>
#include <cassert>

#include "understory/can/wire_length.hpp"

namespace understory::can {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::int64_t kNsPerUs = 1'000;

std::int64_t to_ns(Duration duration) {
  return duration.count() * kNsPerUs;
}

std::int64_t length_ns(const PeriodicMessage& message, int bits_per_s) {
  return worst_case_bits(message.data_bytes) * kNanoseconds / bits_per_s;
}

// How many times a message can be queued within `window_ns`, at worst.
std::int64_t instances(const PeriodicMessage& message, std::int64_t window_ns) {
  const std::int64_t period_ns = to_ns(message.period);
  return (window_ns + to_ns(message.jitter) + period_ns - 1) / period_ns;
}

// The bus as one message meets it.
struct View {
  int bits_per_s = 1;
  PeriodicMessage own;
  std::vector<PeriodicMessage> higher;
  std::int64_t blocking_ns = 0;  // by a lower one that has just begun

  [[nodiscard]] std::int64_t higher_ns(std::int64_t window_ns) const {
    std::int64_t sum_ns = 0;
    for (const PeriodicMessage& message : higher) {
      sum_ns += instances(message, window_ns) * length_ns(message, bits_per_s);
    }
    return sum_ns;
  }
};

View view_of(const std::vector<PeriodicMessage>& messages, std::uint16_t id, int bits_per_s) {
  View view;
  view.bits_per_s = bits_per_s;
  for (const PeriodicMessage& message : messages) {
    if (message.id == id) {
      view.own = message;
    } else if (message.id < id) {
      view.higher.push_back(message);
    } else {
      view.blocking_ns = std::max(view.blocking_ns, length_ns(message, bits_per_s));
    }
  }
  assert(view.own.period > Duration(0));
  return view;
}

// The equations are solved from below; below full load there is a solution.
template <class Equation>
std::int64_t fixed_point(std::int64_t start, const Equation& equation) {
  std::int64_t value = start;
  for (std::int64_t next = equation(value); next != value; next = equation(value)) {
    value = next;
  }
  return value;
}

}  // namespace

double worst_load(const std::vector<PeriodicMessage>& messages, int bits_per_s) {
  double load = 0.0;
  for (const PeriodicMessage& message : messages) {
    load += static_cast<double>(length_ns(message, bits_per_s)) /
            static_cast<double>(to_ns(message.period));
  }
  return load;
}

std::optional<Duration> worst_response(const std::vector<PeriodicMessage>& messages,
                                       std::uint16_t id,
                                       int bits_per_s) {
  const View view = view_of(messages, id, bits_per_s);
  const std::int64_t own_ns = length_ns(view.own, bits_per_s);
  const std::int64_t bit_ns = kNanoseconds / bits_per_s;
  std::vector<PeriodicMessage> busy = view.higher;
  busy.push_back(view.own);
  if (worst_load(busy, bits_per_s) >= 1.0) {
    return std::nullopt;
  }
  // Eq. 8 and 9: the instances in the busy period; not only the first can be the worst.
  const std::int64_t busy_ns = fixed_point(own_ns, [&](std::int64_t window_ns) {
    return view.blocking_ns + view.higher_ns(window_ns) + instances(view.own, window_ns) * own_ns;
  });
  const std::int64_t count = instances(view.own, busy_ns);
  std::int64_t worst_ns = 0;
  for (std::int64_t instance = 0; instance < count; ++instance) {
    // Eq. 10 to 12. A bit time more, because what is queued then still wins the arbitration.
    const std::int64_t before_ns = view.blocking_ns + instance * own_ns;
    const std::int64_t waiting_ns = fixed_point(before_ns, [&](std::int64_t window_ns) {
      return before_ns + view.higher_ns(window_ns + bit_ns);
    });
    worst_ns = std::max(worst_ns, waiting_ns - instance * to_ns(view.own.period) + own_ns);
  }
  const std::int64_t worst_us = (worst_ns + kNsPerUs - 1) / kNsPerUs;
  return view.own.jitter + Duration(worst_us);
}

}  // namespace understory::can
