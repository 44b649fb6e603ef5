// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// For tests of DDS: links, and networks of their own, which need root: a thread that enters one
// takes with it the sockets that are opened there. Real time, with deadlines.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "understory/dds/dds_link.hpp"

namespace understory::test {

constexpr std::chrono::seconds kDdsPatience{20};

bool wait_until(const std::function<bool()>& is_so,
                std::chrono::milliseconds patience = kDdsPatience);

// Not that of another process.
std::string team_of_this_process();

team::Sample sample(const team::SampleKey& key,
                    std::uint64_t version,
                    std::vector<std::uint8_t> payload = {});
// Equal seeds, equal bytes.
std::vector<std::uint8_t> noise(std::size_t size, std::uint32_t seed);

using NewestSamples = std::map<team::SampleKey, team::Sample>;
// The least and the greatest.
std::pair<std::uint64_t, std::uint64_t> versions(const NewestSamples& samples);

// The calling thread leaves the machine's network for an empty one; stays, where it may not.
// False then.
bool enter_network_of_our_own();

// Two networks joined by a cable: the calling thread's, and another.
class TwoNetworks {
 public:
  TwoNetworks();  // in a network of our own already
  TwoNetworks(const TwoNetworks&) = delete;
  TwoNetworks& operator=(const TwoNetworks&) = delete;
  ~TwoNetworks();

  [[nodiscard]] bool is_good() const { return is_good_; }
  [[nodiscard]] static dds::DdsConfig config();  // the cable has this name at both ends
  // On a thread that is in the other network.
  void over_there(const std::function<void()>& act) const;
  // Out of contact: what either sends gets lost, and it is not told.
  void cut() const;
  void mend() const;
  // The interface here is down.
  void unplug() const;

 private:
  int there_ = -1;  // file descriptor of the other network
  bool is_good_ = false;
};

// Null without the right to make them.
std::unique_ptr<TwoNetworks> two_networks();

// A link and the newest of what it has taken.
class DdsEnd {
 public:
  explicit DdsEnd(const dds::DdsConfig& config);
  DdsEnd(const dds::DdsConfig& config, const TwoNetworks& over_there);

  [[nodiscard]] dds::DdsLink& link() { return *link_; }
  // Both take first.
  const NewestSamples& samples();
  bool has(const team::SampleKey& key, std::uint64_t version);
  void forget() { newest_.clear(); }

 private:
  std::unique_ptr<dds::DdsLink> link_;
  NewestSamples newest_;
};

}  // namespace understory::test
