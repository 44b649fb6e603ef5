// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "support/dds_networks.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <thread>

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include "understory/base/rng.hpp"

namespace understory::test {
namespace {

constexpr char kThisNetwork[] = "/proc/thread-self/ns/net";
constexpr char kCable[] = "radio0";

bool runs(const std::string& command) {
  // NOLINTNEXTLINE(bugprone-command-processor): the commands are ours
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}

bool set_up_cable(const std::string& address) {
  return runs("ip addr add " + address + "/24 dev " + kCable) &&
         runs(std::string("ip link set ") + kCable + " up");
}

}  // namespace

bool wait_until(const std::function<bool()>& is_so, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > end) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::string team_of_this_process() {
  return "test_" + std::to_string(getpid());
}

team::Sample sample(const team::SampleKey& key,
                    std::uint64_t version,
                    std::vector<std::uint8_t> payload) {
  return {key, version, std::move(payload)};
}

std::vector<std::uint8_t> noise(std::size_t size, std::uint32_t seed) {
  Rng rng(seed);
  std::vector<std::uint8_t> bytes(size);
  std::generate(
      bytes.begin(), bytes.end(), [&] { return static_cast<std::uint8_t>(rng.below(256)); });
  return bytes;
}

std::pair<std::uint64_t, std::uint64_t> versions(const NewestSamples& samples) {
  std::pair<std::uint64_t, std::uint64_t> range{std::numeric_limits<std::uint64_t>::max(), 0};
  for (const auto& [key, one] : samples) {
    range.first = std::min(range.first, one.version);
    range.second = std::max(range.second, one.version);
  }
  return range;
}

bool enter_network_of_our_own() {
  return unshare(CLONE_NEWNET) == 0 && runs("ip link set lo up");
}

TwoNetworks::TwoNetworks() {
  const int here = open(kThisNetwork, O_RDONLY | O_CLOEXEC);
  std::thread([&] {
    is_good_ = enter_network_of_our_own();
    there_ = open(kThisNetwork, O_RDONLY | O_CLOEXEC);
    // The other end is made where the shell's own file descriptor of `here` points.
    const std::string cable = kCable;
    is_good_ = is_good_ && here >= 0 && there_ >= 0 &&
               runs("ip link add " + cable + " type veth peer name " + cable + " netns /proc/" +
                    std::to_string(getpid()) + "/fd/" + std::to_string(here)) &&
               set_up_cable("10.77.0.2");
  }).join();
  is_good_ = is_good_ && set_up_cable("10.77.0.1");
  close(here);
}

TwoNetworks::~TwoNetworks() {
  close(there_);
}

dds::DdsConfig TwoNetworks::config() {
  dds::DdsConfig config;
  config.interface = kCable;
  return config;
}

void TwoNetworks::over_there(const std::function<void()>& act) const {
  std::thread([&] {
    if (setns(there_, CLONE_NEWNET) == 0) {
      act();
    }
  }).join();
}

void TwoNetworks::cut() const {
  // A queue without room for a packet.
  const auto lose_all = [] {
    runs(std::string("tc qdisc replace dev ") + kCable + " root bfifo limit 1");
  };
  lose_all();
  over_there(lose_all);
}

void TwoNetworks::mend() const {
  const auto lose_none = [] { runs(std::string("tc qdisc del dev ") + kCable + " root"); };
  lose_none();
  over_there(lose_none);
}

void TwoNetworks::unplug() const {
  runs(std::string("ip link set ") + kCable + " down");
}

std::unique_ptr<TwoNetworks> two_networks() {
  if (!enter_network_of_our_own()) {
    return nullptr;
  }
  auto networks = std::make_unique<TwoNetworks>();
  return networks->is_good() ? std::move(networks) : nullptr;
}

DdsEnd::DdsEnd(const dds::DdsConfig& config) : link_(std::make_unique<dds::DdsLink>(config)) {}

DdsEnd::DdsEnd(const dds::DdsConfig& config, const TwoNetworks& over_there) {
  over_there.over_there([&] { link_ = std::make_unique<dds::DdsLink>(config); });
}

const NewestSamples& DdsEnd::samples() {
  for (team::Sample& got : link_->take()) {
    newest_[got.key] = std::move(got);
  }
  return newest_;
}

bool DdsEnd::has(const team::SampleKey& key, std::uint64_t version) {
  const auto found = samples().find(key);
  return found != newest_.end() && found->second.version == version;
}

}  // namespace understory::test
