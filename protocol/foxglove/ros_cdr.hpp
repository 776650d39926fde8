// Figures of a sonar as a ROS 2 message in CDR, the only encoding that PlotJuggler reads over this socket. Pure.
#pragma once

#include <array>
#include <functional>
#include <string_view>

#include "protocol/foxglove/foxglove_words.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::foxglove {

inline constexpr std::array<std::string_view, 15> figure_names = {
    "stamp_s", "number", "range_m", "rate_hz", "simulation_ms", "latency_ms", "clients",    "served",
    "dropped", "x",      "y",       "z",       "roll_deg",      "pitch_deg",  "heading_deg"};

/// The schema of sonard_msgs/msg/SonarFigures: one float64 for each of figure_names.
Schema figures_schema();
wire::Bytes figures(const std::array<double, figure_names.size()>& values);
/// The figures with another stamp_s.
wire::Bytes with_stamp(wire::BytesView figures, const std::function<Time(Time)>& stamp);

}  // namespace sonar::foxglove
