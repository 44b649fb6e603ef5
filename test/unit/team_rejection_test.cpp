// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/team_exchange.hpp"

namespace understory::team {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

// Of vehicle 0: that exactly this one sample is rejected, for this reason, and leaves no trace.
void expect_rejected(const Sample& sample, Rejection reason) {
  Exchange exchange = exchange_of(0);
  const std::uint64_t digest = exchange.map_digest();

  exchange.receive(sample, at(1.0));
  (void)exchange.on_map(unknown_map(), at(1.0));

  EXPECT_EQ(exchange.counters().rejected_for(reason), 1U) << to_string(reason);
  EXPECT_EQ(rejections(exchange.counters()), 1U);
  EXPECT_TRUE(exchange.peers(at(1.0)).empty());
  EXPECT_EQ(exchange.map_digest(), digest);
}

TEST(TeamRejection, RejectsItsOwnId) {
  expect_rejected(state_of(0, state_sample(1)), Rejection::kOwnId);
}

TEST(TeamRejection, RejectsAnIdOutsideOfTheTeam) {
  expect_rejected(state_of(3, state_sample(1)), Rejection::kOutsideTeam);
  expect_rejected(state_of(254, state_sample(1)), Rejection::kOutsideTeam);
}

TEST(TeamRejection, RejectsWhatIsOversized) {
  for (const SampleKind kind :
       {SampleKind::kState, SampleKind::kTrajectory, SampleKind::kTileBlock}) {
    Sample sample = state_of(1, state_sample(1));
    sample.key.kind = kind;
    sample.payload.resize(max_payload_bytes(kind) + 1);
    expect_rejected(sample, Rejection::kOversized);
  }
}

TEST(TeamRejection, RejectsWhatCannotBeRead) {
  Sample empty = state_of(1, state_sample(1));
  empty.payload.clear();
  expect_rejected(empty, Rejection::kMalformed);
  Sample cut_off = state_of(1, state_sample(1));
  cut_off.payload.pop_back();
  expect_rejected(cut_off, Rejection::kMalformed);
  Sample of_no_kind = state_of(1, state_sample(1));
  of_no_kind.key.kind = static_cast<SampleKind>(4);
  expect_rejected(of_no_kind, Rejection::kMalformed);
  Sample of_another_kind = state_of(1, state_sample(1));
  of_another_kind.key.kind = SampleKind::kTrajectory;
  expect_rejected(of_another_kind, Rejection::kMalformed);
}

TEST(TeamRejection, RejectsAVersionThatIsNotThatOfItsContent) {
  Sample sample = state_of(1, state_sample(1));
  ++sample.version;

  expect_rejected(sample, Rejection::kMalformed);
}

TEST(TeamRejection, RejectsValuesThatThereAreNot) {
  StateSample mode = state_sample(1);
  mode.mode = static_cast<FlightMode>(4);
  expect_rejected(state_of(1, mode), Rejection::kMalformed);
  StateSample mission = state_sample(1);
  mission.state = static_cast<MissionState>(9);
  expect_rejected(state_of(1, mission), Rejection::kMalformed);
  StateSample stamp = state_sample(1);
  stamp.stamp = Time(Duration(std::numeric_limits<std::int64_t>::max()));
  expect_rejected(state_of(1, stamp), Rejection::kMalformed);
}

TEST(TeamRejection, RejectsATrajectoryThatCannotBeFlown) {
  const auto rejected_with = [](auto change) {
    TrajectorySample sample{state_sample(1).header,
                            *straight_flight(1, Vector3d::Zero(), Vector3d::Ones(), at(0.0))};
    change(sample.trajectory);
    expect_rejected(sample_of(1, SampleKind::kTrajectory, 0, sample), Rejection::kMalformed);
  };

  rejected_with([](Trajectory& t) { t.position.knot_s = 0.0; });
  rejected_with([](Trajectory& t) { t.position.knot_s = std::nan(""); });
  rejected_with([](Trajectory& t) { t.yaw.knot_s = -0.1; });
  rejected_with([](Trajectory& t) { t.yaw.knot_s = 1e9; });
  rejected_with([](Trajectory& t) { t.position.control_points.clear(); });
  rejected_with([](Trajectory& t) { t.yaw.control_points.clear(); });
  rejected_with([](Trajectory& t) { t.yaw.control_points.resize(5000); });
  rejected_with([](Trajectory& t) { t.mode = static_cast<FlightMode>(4); });
}

TEST(TeamRejection, RejectsATileThatIsNotOfTheMap) {
  const std::vector<LayerTile> unknown(8);
  std::vector<LayerTile> beyond_the_box(8);
  beyond_the_box.back().maybe_solid_rows.fill(0xFFFF);
  const auto blocks = static_cast<std::uint32_t>(TileBlocks(geometry()).count());

  expect_rejected(block_sample(blocks, unknown), Rejection::kMalformed);
  expect_rejected(block_sample(blocks - 1, beyond_the_box), Rejection::kMalformed);
  expect_rejected(block_sample(0, std::vector<LayerTile>(7)), Rejection::kMalformed);
  Sample of_another_block = block_sample(3, unknown);
  of_another_block.key.item = 4;
  expect_rejected(of_another_block, Rejection::kMalformed);
}

TEST(TeamRejection, RejectsAForeignProtocol) {
  StateSample state = state_sample(1);
  state.header.protocol = kProtocolVersion + 1;

  expect_rejected(state_of(1, state), Rejection::kForeignProtocol);
}

TEST(TeamRejection, RejectsAForeignGeometry) {
  for (const GridGeometry& other :
       {GridGeometry(0.15, geometry().box_m()),
        GridGeometry(0.1, Box3d(Vector3d(-2.0, -3.0, 0.0), Vector3d(6.0, 3.0, 2.1)))}) {
    StateSample state = state_sample(1);
    state.header.geometry_hash = hash_of(other);
    expect_rejected(state_of(1, state), Rejection::kForeignGeometry);
  }
}

TEST(TeamRejection, RejectsWhatIsRepeatedOrSuperseded) {
  Exchange receiver = exchange_of(0);
  StateSample old = state_sample(4);
  old.position_m = Vector3d(9.0, 9.0, 9.0);
  receiver.receive(state_of(1, state_sample(5)), at(1.0));

  receiver.receive(state_of(1, state_sample(5)), at(1.1));
  receiver.receive(state_of(1, old), at(1.2));

  EXPECT_EQ(receiver.counters().rejected_for(Rejection::kStale), 2U);
  EXPECT_EQ(rejections(receiver.counters()), 2U);
  EXPECT_EQ(receiver.peers(at(1.2))[0].heard_at, at(1.0));
  EXPECT_TRUE(receiver.peers(at(1.2))[0].position_m.isApprox(state_sample(5).position_m));
}

TEST(TeamRejection, RejectsASessionThatDoesNotFitAVersion) {
  EXPECT_THROW((void)exchange_of(0, std::uint64_t{1} << 51U), ConfigError);
}

// Real samples, altered bit by bit, cut, extended and spliced, most with a version that fits.
class NoisySamples {
 public:
  NoisySamples() {
    Exchange sender = exchange_of(1);
    MapSnapshot map = unknown_map();
    OwnState own = own_state();
    for (std::uint64_t i = 0; i < 20; ++i) {
      change_tile(map, i, rng_);
      (void)sender.on_map(map, at(static_cast<double>(i)));
      own.trajectory = straight_flight(i, {-1.0, -2.0, 1.0}, {5.0, 2.0, 1.3}, at(5.0));
      const std::vector<Sample> due = sender.due(own, at(static_cast<double>(i) + 0.5));
      real_.insert(real_.end(), due.begin(), due.end());
    }
  }

  Sample next() {
    Sample sample = real_[rng_.below(real_.size())];
    const std::uint64_t damage = rng_.below(8);
    if (damage == 0) {
      sample.payload.assign(rng_.below(200), 0);
      std::generate(sample.payload.begin(), sample.payload.end(), [&] { return byte(); });
    } else if (damage == 1) {
      sample.payload.resize(rng_.below(sample.payload.size() + 1));
    } else if (damage == 2) {
      const std::vector<std::uint8_t>& other = real_[rng_.below(real_.size())].payload;
      const auto from = static_cast<std::ptrdiff_t>(rng_.below(other.size()));
      sample.payload.insert(sample.payload.end(), other.begin() + from, other.end());
    }
    for (std::uint64_t left = rng_.below(4); left > 0 && !sample.payload.empty(); --left) {
      sample.payload[rng_.below(sample.payload.size())] = byte();
    }
    if (rng_.below(8) == 0) {
      sample.key = {byte(),
                    static_cast<SampleKind>(rng_.below(6)),
                    static_cast<std::uint32_t>(rng_.below(60))};
    }
    const std::optional<SampleHeader> header = decode_header(sample.payload);
    sample.version = header && rng_.below(16) != 0 ? version_of(*header) : rng_.next();
    return sample;
  }

 private:
  std::uint8_t byte() { return static_cast<std::uint8_t>(rng_.below(256)); }

  Rng rng_{99};
  std::vector<Sample> real_;
};

bool is_sane(const Peer& peer) {
  if (!peer.position_m.allFinite() || !peer.velocity_mps.allFinite() ||
      !std::isfinite(peer.yaw_rad)) {
    return false;
  }
  if (!peer.trajectory) {
    return true;
  }
  const TrajectoryPoint end = peer.trajectory->sample(peer.trajectory->end());
  return end.position_m.allFinite() && std::isfinite(end.yaw_rad) && end.velocity_mps.isZero(0.0);
}

TEST(TeamRejection, BearsAHundredThousandDamagedSamples) {
  NoisySamples noise;
  Exchange receiver = exchange_of(0);
  MapSnapshot own = unknown_map();

  for (int i = 0; i < 100'000; ++i) {
    receiver.receive(noise.next(), at(1e-4 * i));
    for (const Peer& peer : receiver.peers(at(1e-4 * i))) {
      ASSERT_TRUE(is_sane(peer)) << i;
    }
    if (i % 1000 == 0) {
      ++own.revision;
      (void)receiver.on_map(own, at(1e-4 * i));
      (void)receiver.due(own_state(), at(1e-4 * i));
    }
  }

  const Counters& counters = receiver.counters();
  const std::uint64_t accepted =
      counters.accepted[0].samples + counters.accepted[1].samples + counters.accepted[2].samples;
  EXPECT_EQ(accepted + rejections(counters), 100'000U);
  EXPECT_GT(accepted, 5U);
  EXPECT_GT(counters.rejected_for(Rejection::kMalformed), 10'000U);
}

}  // namespace
}  // namespace understory::team
