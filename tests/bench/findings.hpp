// Further measurements of the benchmark, in addition to rates of warm pings: cold pings after a jump, moving objects, equal
// bytes, empty bins. Each function prints a line and returns its part of the JSON.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include "core/base/result.hpp"
#include "tests/bench/measure.hpp"

namespace sonar::bench {

using ScenePointer = std::shared_ptr<const Scene>;

/// P3e: the first ping after a jump to a place without cells, everything else warm; for P1 and P3d.
nlohmann::json find_cold_pings(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);
/// P7: additional time of a ping of P1 if 100 rigid objects move instead of resting, and the time to place them.
nlohmann::json find_cost_of_objects(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);
/// P15: processor time of pings with the elevation pattern's side lobes divided by that without them, alternating, on one
/// thread.
nlohmann::json find_cost_of_side_lobes(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);
/// P9: SHA-256 of the samples of P1, P3a and P3d with 1, 2 and 4 threads, each twice.
nlohmann::json find_hashes(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);
/// P12: bins of a level bed whose expected power is 10 dB or more below the closed form, with cells and with one scatterer for
/// each ray.
Result<nlohmann::json> find_empty_bins(const BenchOptions& options);

/// P10 and P11: pings per second of P1 and P3a in batches on the device, by batch size; the shares of processor and device; the
/// ratio to the public reference code.
Result<nlohmann::json> find_device_rates(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);

/// Measures how the time of a ping grows with rays, rows, triangles, beams and sonars.
nlohmann::json find_curves(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);

/// P0: the demo of every product through its socket, at the rate that a usual driver requests. Each make's demo also runs at
/// its highest rate. Measures the time from a ping's pose to its last byte at the driver, the processor time of the daemon, and
/// skipped ticks.
Result<nlohmann::json> find_demos(const BenchOptions& options);
/// P5: time from sending a pose and a trigger to the last received byte, for a whole daemon on loopback.
Result<nlohmann::json> find_latency(const ScenePointer& scene, const BenchOptions& options);
/// P14: time from sending a changed setting to the first ping with it, over a grid of settings. Sets `holds` to whether first
/// pings need little more processor time than warm ones.
Result<nlohmann::json> find_first_pings(const ScenePointer& scene, const BenchOptions& options, bool& holds);
/// P8: a whole daemon with clients that receive every ping: dropped pings, and the processor time of sending.
Result<nlohmann::json> find_cost_of_clients(const ScenePointer& scene, int clients, double seconds, const BenchOptions& options);
/// P13: rates of P1, P3a and P3d with 1, 2 and 4 threads.
nlohmann::json find_rates_of_threads(const ScenePointer& scene, const BenchScene& where, const BenchOptions& options);
/// P13: pings per second of several P900-90 (2 to 10 m) in one daemon, whose clients request the next ping when they have
/// received the last: the total, the slowest and the fastest.
Result<nlohmann::json> find_rates_of_sonars(const ScenePointer& scene, int sonars, double seconds, const BenchOptions& options);

}  // namespace sonar::bench
