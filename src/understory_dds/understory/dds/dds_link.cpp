// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/dds/dds_link.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <string>

#include <dds/dds.h>
#include <fmt/format.h>
#include <team_sample.h>

#include "understory/dds/dds_settings.hpp"

namespace understory::dds {
namespace {

// The number is the protocol's version.
constexpr char kTopic[] = "understory_team_1";
constexpr std::uint8_t kNobody = 255;

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

// The newest of every key, for those who come later too, and not for ourselves.
Qos newest_of_every_key() {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_durability_service(qos.get(),
                              0,
                              DDS_HISTORY_KEEP_LAST,
                              1,
                              DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED);
  dds_qset_writer_data_lifecycle(qos.get(), false);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

// CycloneDDS writes to stderr what it cannot do, which is every packet while the network is away.
void ignore(void* /*argument*/, const dds_log_data_t* /*data*/) {}

// What it says while this exists; for why a construction fails.
class Complaints {
 public:
  Complaints() { dds_set_log_sink(&Complaints::add, this); }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;
  ~Complaints() { dds_set_log_sink(&ignore, nullptr); }

  // Empty, or the first line and a colon before it.
  [[nodiscard]] std::string first() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return first_.empty() ? first_ : ": " + first_;
  }

 private:
  static void add(void* argument, const dds_log_data_t* data) {
    auto& complaints = *static_cast<Complaints*>(argument);
    const std::lock_guard<std::mutex> lock(complaints.mutex_);
    if (complaints.first_.empty()) {
      const std::string text(data->message, data->size);
      complaints.first_ = text.substr(0, text.find('\n'));
    }
  }

  std::mutex mutex_;  // all threads of CycloneDDS may complain
  std::string first_;
};

// Every link has a domain of its own, whose number counts within the process alone; what the
// network sees is the domain of the settings. So links of one process may differ in their settings.
dds_entity_t create_domain(const std::string& settings) {
  dds_domainid_t number = 0;
  dds_entity_t domain = 0;
  do {
    domain = dds_create_domain(number, settings.c_str());
    ++number;
  } while (domain == DDS_RETCODE_PRECONDITION_NOT_MET);
  return domain;
}

struct Endpoints {
  dds_entity_t reader = 0;
  dds_entity_t writer = 0;
};

// Negative where DDS refused.
Endpoints create_endpoints(dds_entity_t domain) {
  dds_domainid_t number = 0;
  dds_get_domainid(domain, &number);
  const dds_entity_t participant = dds_create_participant(number, nullptr, nullptr);
  const Qos qos = newest_of_every_key();
  const dds_entity_t topic =
      dds_create_topic(participant, &understory_dds_TeamSample_desc, kTopic, qos.get(), nullptr);
  return {dds_create_reader(participant, topic, qos.get(), nullptr),
          dds_create_writer(participant, topic, qos.get(), nullptr)};
}

bool is_well_formed(const understory_dds_TeamSample& sample) {
  return sample.vehicle != kNobody && sample.payload._length <= kMaxPayloadBytes &&
         sample.kind >= static_cast<std::uint8_t>(team::SampleKind::kState) &&
         sample.kind <= static_cast<std::uint8_t>(team::SampleKind::kTileBlock);
}

team::Sample to_sample(const understory_dds_TeamSample& from) {
  team::Sample sample;
  sample.key = {from.vehicle, static_cast<team::SampleKind>(from.kind), from.item};
  sample.version = from.version;
  sample.payload.assign(from.payload._buffer, from.payload._buffer + from.payload._length);
  return sample;
}

}  // namespace

DdsLink::DdsLink(const DdsConfig& config) {
  const std::string settings = cyclone_settings(config);
  if (!config.interface.empty()) {
    check_interface(config.interface);
  }
  Complaints complaints;
  domain_ = create_domain(settings);
  Endpoints endpoints;
  if (domain_ >= 0) {
    endpoints = create_endpoints(domain_);
  }
  const std::int32_t worst = std::min({domain_, endpoints.reader, endpoints.writer});
  if (worst < 0) {
    if (domain_ >= 0) {
      dds_delete(domain_);
    }
    throw ConfigError(fmt::format("dds: interface: cannot use {}{}",
                                  config.interface.empty() ? "any" : "`" + config.interface + "`",
                                  complaints.first()));
  }
  reader_ = endpoints.reader;
  writer_ = endpoints.writer;
}

DdsLink::~DdsLink() {
  dds_delete(domain_);
}

void DdsLink::publish(team::Sample sample) {
  understory_dds_TeamSample message{};
  message.vehicle = sample.key.vehicle;
  message.kind = static_cast<std::uint8_t>(sample.key.kind);
  message.item = sample.key.item;
  message.version = sample.version;
  message.payload._buffer = sample.payload.data();
  message.payload._length = static_cast<std::uint32_t>(sample.payload.size());
  message.payload._maximum = message.payload._length;
  const bool is_sent =
      sample.payload.size() <= kMaxPayloadBytes && dds_write(writer_, &message) == DDS_RETCODE_OK;
  ++(is_sent ? counters_.sent : counters_.refused);
}

std::vector<team::Sample> DdsLink::take() {
  std::vector<team::Sample> samples;
  std::array<void*, kMostPerTake> lent{};  // by DDS, where there is nothing
  std::array<dds_sample_info_t, kMostPerTake> infos{};
  const dds_return_t count =
      dds_take(reader_, lent.data(), infos.data(), kMostPerTake, kMostPerTake);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(0, count)); ++i) {
    const auto& message = *static_cast<const understory_dds_TeamSample*>(lent.at(i));
    if (!infos.at(i).valid_data) {
      continue;  // says only that its writer has gone
    }
    if (!is_well_formed(message)) {
      ++counters_.malformed;
      continue;
    }
    ++counters_.received;
    samples.push_back(to_sample(message));
  }
  if (count > 0) {
    dds_return_loan(reader_, lent.data(), count);
  }
  return samples;
}

std::size_t DdsLink::mates() const {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(writer_, &status);
  return status.current_count;
}

}  // namespace understory::dds
