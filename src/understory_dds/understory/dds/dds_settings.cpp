// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/dds/dds_settings.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <memory>
#include <sstream>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

namespace understory::dds {
namespace {

// Fragments fit into an Ethernet frame, so that a lost frame costs one of them. What is missing is
// asked for at once. A writer must never wait for readers out of contact (the watermarks), nor a
// destructor (the linger); and it must tell those that come back soon what they missed (the
// longest heartbeat, else 8 s).
constexpr char kSettings[] = R"(<CycloneDDS><Domain id="any">
<General>
  {interfaces}
  <AllowMulticast>{multicast}</AllowMulticast>
  <MaxMessageSize>1400 B</MaxMessageSize>
  <MaxRexmitMessageSize>1400 B</MaxRexmitMessageSize>
  <FragmentSize>1300 B</FragmentSize>
</General>
<Discovery>
  <ExternalDomainId>{domain}</ExternalDomainId>
  <Tag>{team}</Tag>
  <SPDPInterval>1 s</SPDPInterval>
  <LeaseDuration>{lease_ms} ms</LeaseDuration>
  <ParticipantIndex>auto</ParticipantIndex>
  <MaxAutoParticipantIndex>{last_index}</MaxAutoParticipantIndex>
  {peers}
</Discovery>
<Internal>
  <Watermarks>
    <WhcHigh>1 GB</WhcHigh><WhcHighInit>1 GB</WhcHighInit><WhcAdaptive>false</WhcAdaptive>
  </Watermarks>
  <HeartbeatInterval max="1 s">100 ms</HeartbeatInterval>
  <NackDelay>10 ms</NackDelay>
  <AutoReschedNackDelay>1 s</AutoReschedNackDelay>
  <WriterLingerDuration>0 s</WriterLingerDuration>
  <MaxSampleSize>1 MB</MaxSampleSize>
</Internal>
</Domain></CycloneDDS>)";

// So many vehicles of one machine can find each other without multicast; each peer is asked at so
// many ports every second.
constexpr int kLinksPerMachine = 10;

// Nothing that means something in XML.
void check_name(const char* key, const std::string& name) {
  const bool is_plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == ':';
  });
  if (!is_plain) {
    throw ConfigError(fmt::format(
        "dds: {}: `{}` has other characters than letters, digits and _ - . :", key, name));
  }
}

std::string peers_element(const std::string& peers) {
  std::string elements;
  std::istringstream words(peers);
  for (std::string address; words >> address;) {
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
      throw ConfigError(fmt::format("dds: peers: `{}` is not an IPv4 address", address));
    }
    elements += fmt::format("<Peer address=\"{}\"/>", address);
  }
  return elements.empty() ? elements : "<Peers>" + elements + "</Peers>";
}

struct FreeInterfaces {
  void operator()(ifaddrs* list) const { freeifaddrs(list); }
};

// Of those with an IPv4 address.
std::map<std::string, unsigned> flags_by_interface() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) {
    return {};
  }
  const std::unique_ptr<ifaddrs, FreeInterfaces> list(first);
  std::map<std::string, unsigned> flags;
  for (const ifaddrs* entry = list.get(); entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET) {
      flags[entry->ifa_name] = entry->ifa_flags;
    }
  }
  return flags;
}

}  // namespace

std::string cyclone_settings(const DdsConfig& config) {
  check_name("interface", config.interface);
  check_name("team", config.team);
  const std::string peers = peers_element(config.peers);
  if (!config.multicast && peers.empty()) {
    throw ConfigError("dds: peers: without multicast there must be some");
  }
  // The loopback interface can do multicast but does not say so.
  const std::string interfaces =
      config.interface.empty()
          ? std::string()
          : fmt::format("<Interfaces><NetworkInterface name=\"{}\" multicast=\"{}\"/></Interfaces>",
                        config.interface,
                        config.multicast);
  return fmt::format(kSettings,
                     fmt::arg("interfaces", interfaces),
                     fmt::arg("multicast", config.multicast ? "spdp" : "false"),
                     fmt::arg("domain", config.domain),
                     fmt::arg("team", config.team),
                     fmt::arg("lease_ms", static_cast<std::int64_t>(1e3 * config.lease_s)),
                     fmt::arg("last_index", kLinksPerMachine - 1),
                     fmt::arg("peers", peers));
}

void check_interface(const std::string& interface) {
  const std::map<std::string, unsigned> flags = flags_by_interface();
  const auto found = flags.find(interface);
  if (found == flags.end()) {
    std::string names;
    for (const auto& [name, ignored] : flags) {
      names += " " + name;
    }
    throw ConfigError(
        fmt::format("dds: interface: `{}` does not exist or has no IPv4 address; these have:{}",
                    interface,
                    names.empty() ? " none" : names));
  }
  if ((found->second & IFF_UP) == 0) {
    throw ConfigError(fmt::format("dds: interface: `{}` is down", interface));
  }
}

}  // namespace understory::dds
