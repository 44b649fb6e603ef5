// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/sample_codec.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "samples.pb.h"

namespace understory::team {
namespace {

constexpr std::int64_t kMaxStampUs = std::int64_t{1} << 56U;  // sums of them do not overflow
constexpr std::uint64_t kMaxSession = std::uint64_t{1} << 51U;
constexpr std::int64_t kMaxUnits = 200'000'000;  // 200 km, 20 krad; differences fit 32 bits
constexpr int kMaxControlPoints = 4096;
constexpr double kUnitsPerM = 1e3;
constexpr double kUnitsPerRad = 1e4;
constexpr double kMinKnot_s = 1e-3;
constexpr double kMaxKnot_s = 100.0;

std::int32_t to_units(double value, double units) {
  const auto limit = static_cast<double>(kMaxUnits);
  return static_cast<std::int32_t>(std::llround(std::clamp(value * units, -limit, limit)));
}

bool is_stamp(std::int64_t stamp_us) {
  return stamp_us > -kMaxStampUs && stamp_us < kMaxStampUs;
}

Time time_of(std::int64_t stamp_us) {
  return Time(Duration(stamp_us));
}

std::int64_t microseconds_of(Time time) {
  return time.time_since_epoch().count();
}

// Null if the bytes are no such message.
template <class Message>
std::optional<Message> parsed(const Encoded& payload) {
  std::optional<Message> message(std::in_place);
  const auto size = static_cast<int>(std::min<std::size_t>(payload.size(), 1U << 24U));
  if (!message->ParseFromArray(payload.data(), size)) {
    message.reset();
  }
  return message;
}

template <class Message>
Encoded serialised(const Message& message) {
  Encoded encoded(message.ByteSizeLong());
  message.SerializeToArray(encoded.data(), static_cast<int>(encoded.size()));
  return encoded;
}

void write(const SampleHeader& header, wire::Header& to) {
  to.set_protocol(header.protocol);
  to.set_geometry(header.geometry_hash);
  to.set_session(header.session);
  to.set_count(header.count);
}

template <class Message>
std::optional<SampleHeader> header_of(const Message& message) {
  const wire::Header& header = message.header();
  if (!message.has_header() || header.session() >= kMaxSession || header.count() >= kMaxSession) {
    return std::nullopt;
  }
  return SampleHeader{header.protocol(), header.geometry(), header.session(), header.count()};
}

void write(const Vector3d& value, wire::Point& to) {
  to.set_x(to_units(value.x(), kUnitsPerM));
  to.set_y(to_units(value.y(), kUnitsPerM));
  to.set_z(to_units(value.z(), kUnitsPerM));
}

Vector3d vector_of(const wire::Point& point) {
  return Vector3d(point.x(), point.y(), point.z()) / kUnitsPerM;
}

std::optional<Echo> echo_of(const wire::Echo& echo) {
  if (echo.vehicle() >= kMaxTeam || echo.session() >= kMaxSession || !is_stamp(echo.stamp_us()) ||
      echo.held_us() >= static_cast<std::uint64_t>(kMaxStampUs)) {
    return std::nullopt;
  }
  return Echo{static_cast<std::uint8_t>(echo.vehicle()),
              echo.session(),
              time_of(echo.stamp_us()),
              Duration(static_cast<std::int64_t>(echo.held_us()))};
}

std::optional<FlightMode> mode_of(std::uint32_t mode) {
  return mode <= static_cast<std::uint32_t>(FlightMode::kBrake)
             ? std::optional(static_cast<FlightMode>(mode))
             : std::nullopt;
}

std::optional<MissionState> mission_of(std::uint32_t state) {
  return state <= static_cast<std::uint32_t>(MissionState::kMeet)
             ? std::optional(static_cast<MissionState>(state))
             : std::nullopt;
}

// The values of every `dimension`-th entry from `first` on, as sums of what was told; none if they
// leave the bounds.
using Told = google::protobuf::RepeatedField<std::int32_t>;
std::optional<std::vector<double>> summed(const Told& told,
                                          int first,
                                          int dimension,
                                          double units) {
  std::vector<double> values;
  std::int64_t sum = 0;
  for (int i = first; i < told.size(); i += dimension) {
    sum += told[i];
    if (std::abs(sum) > kMaxUnits) {
      return std::nullopt;
    }
    values.push_back(static_cast<double>(sum) / units);
  }
  return values;
}

// A spline is at rest at its end when its last three control points are the same.
template <class Point>
void end_at_rest(std::vector<Point>& points) {
  const auto is_at_rest = [&points] {
    const std::size_t n = points.size();
    return points[n - 1] == points[n - 2] && points[n - 2] == points[n - 3];
  };
  while (points.size() < 4 || !is_at_rest()) {
    points.push_back(Point(points.back()));
  }
}

bool is_knot(double knot_s) {
  return knot_s >= kMinKnot_s && knot_s <= kMaxKnot_s;  // false for NaN
}

std::optional<CubicBSpline<Vector3d>> position_of(const wire::Trajectory& message) {
  const Told& told = message.position_mm();
  if (told.empty() || told.size() % 3 != 0 || told.size() > 3 * kMaxControlPoints ||
      !is_knot(message.position_knot_s())) {
    return std::nullopt;
  }
  const auto x = summed(told, 0, 3, kUnitsPerM);
  const auto y = summed(told, 1, 3, kUnitsPerM);
  const auto z = summed(told, 2, 3, kUnitsPerM);
  if (!x || !y || !z) {
    return std::nullopt;
  }
  CubicBSpline<Vector3d> spline{{}, message.position_knot_s()};
  for (std::size_t i = 0; i < x->size(); ++i) {
    spline.control_points.emplace_back((*x)[i], (*y)[i], (*z)[i]);
  }
  end_at_rest(spline.control_points);
  return spline;
}

std::optional<CubicBSpline<double>> yaw_of(const wire::Trajectory& message) {
  const Told& told = message.yaw_tenth_mrad();
  if (told.empty() || told.size() > kMaxControlPoints || !is_knot(message.yaw_knot_s())) {
    return std::nullopt;
  }
  auto values = summed(told, 0, 1, kUnitsPerRad);
  if (!values) {
    return std::nullopt;
  }
  end_at_rest(*values);
  return CubicBSpline<double>{std::move(*values), message.yaw_knot_s()};
}

}  // namespace

std::uint32_t hash_of(const GridGeometry& geometry) {
  constexpr std::uint32_t kPrime = 16777619U;
  std::uint32_t hash = 2166136261U;
  const auto add = [&hash](std::int64_t value) {
    for (unsigned shift = 0; shift < 64; shift += 8) {
      hash = (hash ^ static_cast<std::uint32_t>((value >> shift) & 0xFF)) * kPrime;
    }
  };
  add(std::llround(geometry.resolution_m() * 1e6));
  for (int axis = 0; axis < 3; ++axis) {
    add(geometry.voxels().min[axis]);
    add(geometry.voxels().end[axis]);
  }
  return hash;
}

std::size_t max_payload_bytes(SampleKind kind) {
  switch (kind) {
    case SampleKind::kState:
      return 2048;
    case SampleKind::kTrajectory:
      return 60000;
    case SampleKind::kTileBlock:
      return kMaxLayersBytes + 100;
  }
  return 0;
}

Encoded encode(const StateSample& sample) {
  wire::State message;
  write(sample.header, *message.mutable_header());
  message.set_stamp_us(microseconds_of(sample.stamp));
  write(sample.position_m, *message.mutable_position_mm());
  write(sample.velocity_mps, *message.mutable_velocity_mmps());
  message.set_yaw_tenth_mrad(to_units(sample.yaw_rad, kUnitsPerRad));
  message.set_mode(static_cast<std::uint32_t>(sample.mode));
  message.set_mission(static_cast<std::uint32_t>(sample.state));
  if (sample.target_m) {
    write(*sample.target_m, *message.mutable_target_mm());
  }
  for (const Echo& echo : sample.echoes) {
    wire::Echo& to = *message.add_echoes();
    to.set_vehicle(echo.vehicle);
    to.set_session(echo.session);
    to.set_stamp_us(microseconds_of(echo.stamp));
    to.set_held_us(static_cast<std::uint64_t>(std::max<Duration::rep>(0, echo.held.count())));
  }
  return serialised(message);
}

Encoded encode(const TrajectorySample& sample) {
  const Trajectory& trajectory = sample.trajectory;
  wire::Trajectory message;
  write(sample.header, *message.mutable_header());
  message.set_id(trajectory.id);
  message.set_start_us(microseconds_of(trajectory.start));
  message.set_depth_stamp_us(microseconds_of(trajectory.depth_stamp));
  message.set_mode(static_cast<std::uint32_t>(trajectory.mode));
  message.set_position_knot_s(trajectory.position.knot_s);
  message.set_yaw_knot_s(trajectory.yaw.knot_s);
  std::array<std::int32_t, 3> last_mm{};
  for (const Vector3d& point : trajectory.position.control_points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t mm = to_units(point[static_cast<Eigen::Index>(axis)], kUnitsPerM);
      message.add_position_mm(mm - last_mm[axis]);
      last_mm[axis] = mm;
    }
  }
  std::int32_t last_yaw = 0;
  for (const double yaw_rad : trajectory.yaw.control_points) {
    const std::int32_t yaw = to_units(yaw_rad, kUnitsPerRad);
    message.add_yaw_tenth_mrad(yaw - last_yaw);
    last_yaw = yaw;
  }
  return serialised(message);
}

Encoded encode(const TileBlockSample& sample) {
  wire::TileBlock message;
  write(sample.header, *message.mutable_header());
  message.set_block(sample.block);
  const std::vector<std::uint8_t> layers = encode_layers(sample.layers);
  message.set_layers(layers.data(), layers.size());
  return serialised(message);
}

std::optional<SampleHeader> decode_header(const Encoded& payload) {
  const auto message = parsed<wire::Any>(payload);
  return message ? header_of(*message) : std::nullopt;
}

std::optional<StateSample> decode_state(const Encoded& payload) {
  const auto message = parsed<wire::State>(payload);
  if (!message || !message->has_position_mm() || !message->has_velocity_mmps() ||
      !is_stamp(message->stamp_us()) || message->echoes_size() > static_cast<int>(kMaxTeam)) {
    return std::nullopt;
  }
  const auto header = header_of(*message);
  const auto mode = mode_of(message->mode());
  const auto mission = mission_of(message->mission());
  if (!header || !mode || !mission) {
    return std::nullopt;
  }
  StateSample sample;
  sample.header = *header;
  sample.stamp = time_of(message->stamp_us());
  sample.position_m = vector_of(message->position_mm());
  sample.velocity_mps = vector_of(message->velocity_mmps());
  sample.yaw_rad = message->yaw_tenth_mrad() / kUnitsPerRad;
  sample.mode = *mode;
  sample.state = *mission;
  if (message->has_target_mm()) {
    sample.target_m = vector_of(message->target_mm());
  }
  for (const wire::Echo& told : message->echoes()) {
    const auto echo = echo_of(told);
    if (!echo) {
      return std::nullopt;
    }
    sample.echoes.push_back(*echo);
  }
  return sample;
}

std::optional<TrajectorySample> decode_trajectory(const Encoded& payload) {
  const auto message = parsed<wire::Trajectory>(payload);
  if (!message || !is_stamp(message->start_us()) || !is_stamp(message->depth_stamp_us())) {
    return std::nullopt;
  }
  const auto header = header_of(*message);
  const auto mode = mode_of(message->mode());
  auto position = position_of(*message);
  auto yaw = yaw_of(*message);
  if (!header || !mode || !position || !yaw) {
    return std::nullopt;
  }
  TrajectorySample sample;
  sample.header = *header;
  sample.trajectory.id = message->id();
  sample.trajectory.start = time_of(message->start_us());
  sample.trajectory.depth_stamp = time_of(message->depth_stamp_us());
  sample.trajectory.mode = *mode;
  sample.trajectory.position = std::move(*position);
  sample.trajectory.yaw = std::move(*yaw);
  return sample;
}

std::optional<TileBlockSample> decode_tile_block(const Encoded& payload) {
  const auto message = parsed<wire::TileBlock>(payload);
  if (!message) {
    return std::nullopt;
  }
  const auto header = header_of(*message);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): protobuf holds bytes as characters
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(message->layers().data());
  auto layers = decode_layers(bytes, message->layers().size());
  if (!header || !layers) {
    return std::nullopt;
  }
  return TileBlockSample{*header, message->block(), std::move(*layers)};
}

}  // namespace understory::team
