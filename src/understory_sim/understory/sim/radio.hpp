// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The carrier of a simulated team: broadcast radios on virtual time that do what a DDS writer and
// reader do with RELIABLE, TRANSIENT_LOCAL, KEEP_LAST 1 and a key. The newest sample of every key
// reaches everyone in contact sooner or later, what was missed out of contact after it; what a
// newer one has replaced is never sent. Small kinds go first, tiles by age. A sender has a rate of
// its own, senders do not disturb each other. A sample is one packet. World frame, SI units, one
// thread; the same arguments give the same bits. Constructing throws ConfigError.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <tuple>
#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"
#include "understory/base/rng.hpp"
#include "understory/base/time.hpp"
#include "understory/sim/radio_outbox.hpp"
#include "understory/team/link.hpp"

namespace understory {

class ForestTruth;
class RadioStation;

struct RadioCutConfig {
  double from_s = 0.0;
  double to_s = 0.0;

  void visit(FieldVisitor& f) {
    f.field("from_s", from_s, in_range(0.0, 1e6), "since the start of the mission");
    f.field("to_s", to_s, in_range(0.0, 1e6), "from then on they hear each other again");
  }
};

struct RadioConfig {
  double range_m = 50.0;
  double loss = 0.05;
  double delay_s = 0.02;
  double rate_bytes_per_s = 125000.0;
  int header_bytes = 64;
  double retry_s = 0.2;
  bool occlusion = false;
  std::vector<RadioCutConfig> cuts;

  void visit(FieldVisitor& f) {
    f.field("range_m", range_m, in_range(0.0, 1e5), "vehicles further apart are out of contact");
    f.field(
        "loss", loss, in_range(0.0, 1.0), "probability that a packet does not reach a receiver");
    f.field("delay_s", delay_s, in_range(0.0, 10.0), "from the end of sending to arrival");
    f.field("rate_bytes_per_s", rate_bytes_per_s, in_range(100.0, 1e9), "of each sender");
    f.field("header_bytes", header_bytes, in_range(0, 10000), "added to every sample");
    f.field("retry_s", retry_s, in_range(0.001, 60.0), "a lost packet is sent again after this");
    f.field("occlusion", occlusion, "trunks between two vehicles break contact");
    f.list("cuts", cuts, "While these last nobody hears anybody.");
  }
};

inline constexpr Duration kCatchUp = std::chrono::seconds(5);

// Of one vehicle; counts of samples that were received by or lost to it, of bytes that it sent.
struct RadioUse {
  std::uint64_t samples_sent = 0;  // transmissions: one for all receivers
  std::uint64_t bytes_sent = 0;
  std::uint64_t peak_bytes_in_a_second = 0;  // of any second, aligned or not
  // The same without the first kCatchUp of a contact, in which what was missed is sent.
  std::uint64_t steady_peak_bytes_in_a_second = 0;
  std::uint64_t samples_delivered = 0;
  std::uint64_t samples_lost = 0;
};

using LineBlocked = std::function<bool(const Vector3d& from_m, const Vector3d& to_m)>;

// Whether a trunk stands in the straight line, below its top; meshes are not looked at.
[[nodiscard]] bool trunk_between(const ForestTruth& truth,
                                 const Vector3d& from_m,
                                 const Vector3d& to_m);

class SimulatedRadio {
 public:
  // The predicate is asked only with `occlusion`, and needed with it.
  SimulatedRadio(const RadioConfig& config,
                 int vehicles,
                 const Rng& rng,
                 LineBlocked is_blocked = {});
  ~SimulatedRadio();
  SimulatedRadio(const SimulatedRadio&) = delete;
  SimulatedRadio& operator=(const SimulatedRadio&) = delete;

  // Lives as long as the radio.
  [[nodiscard]] team::Link& link(int vehicle);

  // Sends and delivers what happens up to `now`, which never goes back. What is published between
  // two calls counts as published at the time of the first of them: so first advance to a time,
  // then let the vehicles take and publish at it. A position per vehicle, as of now.
  void advance(Time now, const std::vector<Vector3d>& positions_m);

  // As of the latest advance; a vehicle is not in contact with itself.
  [[nodiscard]] bool are_in_contact(int a, int b) const;

  // For good: hears and sends nothing more, and what it had not sent yet is gone with it.
  void switch_off(int vehicle);

  [[nodiscard]] const RadioUse& use(int vehicle) const;

 private:
  [[nodiscard]] RadioStation& station(int vehicle) const;
  void find_contacts(Time now, const std::vector<Vector3d>& positions_m);
  void send(int sender, Time begin, Time end);
  void transmit(int sender, const RadioOutbox::Offer& offer, Time sent_at);
  void deliver(Time now);

  struct Flight {
    Time arrives_at;
    std::uint64_t number;
    int sender;
    int receiver;
    std::shared_ptr<const team::Sample> sample;

    // Of two, the one that a heap keeps deeper.
    bool operator<(const Flight& other) const {
      return std::tie(arrives_at, number) > std::tie(other.arrives_at, other.number);
    }
  };

  RadioConfig config_;
  LineBlocked is_blocked_;
  std::vector<std::unique_ptr<RadioStation>> stations_;
  std::vector<VehicleSet> contacts_;  // of each vehicle
  std::vector<Flight> in_flight_;     // a heap
  std::uint64_t flights_ = 0;
  Time advanced_to_{};
  bool has_advanced_ = false;
};

}  // namespace understory
