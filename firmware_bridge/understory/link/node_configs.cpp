// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/node_configs.hpp"

#include "understory/can/messages.hpp"

namespace understory::can {
namespace {

constexpr double kOnEventHz = 100.0;

CanNodeConfig node_config(bool is_host) {
  CanNodeConfig config;
  for (const MessageInfo& message : kMessages) {
    if (message.is_from_host == is_host) {
      config.transmits[message.id] = true;
    } else {
      const double rate_hz = message.period_ms > 0 ? 1000.0 / message.period_ms : kOnEventHz;
      config.receives.push_back({message.id, rate_hz});
    }
  }
  return config;
}

}  // namespace

CanNodeConfig host_node_config() {
  CanNodeConfig config = node_config(true);
  config.answers = false;
  config.set = id_set({SpPosXy::kId, SpPosZ::kId, SpVel::kId, SpAcc::kId, SpCommit::kId});
  return config;
}

CanNodeConfig vehicle_node_config() {
  CanNodeConfig config = node_config(false);
  config.set = id_set({OdoPosXy::kId, OdoPosZ::kId, OdoVel::kId, OdoAtt::kId, OdoRate::kId});
  return config;
}

}  // namespace understory::can
