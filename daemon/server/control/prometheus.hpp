// Writes the figures in the text format 0.0.4 of Prometheus, with conventional names (base units, _total for counters).
// Operations::metrics() calls metrics_text, and docs/operations.md explains the counters.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/emulator/connections/outbox.hpp"
#include "daemon/emulator/view/viewer.hpp"
#include "daemon/server/poses/pose_intake.hpp"

namespace sonar {

// Measures memory, descriptors, threads and processor time of this process, for /metrics and the status.

struct ProcessFigures {
  std::uint64_t resident_bytes = 0, open_descriptors = 0, descriptor_limit = 0, threads = 0;
  double processor_s = 0;
};
/// Reads /proc; unreadable values are 0.
ProcessFigures figures_of_this_process();

/// Writes families in sequence: the head of a family, then all its samples.
class PrometheusText {
 public:
  using Labels = std::vector<std::pair<std::string_view, std::string_view>>;
  enum class Type { counter, gauge, histogram };

  void family(std::string_view name, Type type, std::string_view help);
  /// Writes a sample of the current family. Whole numbers up to 2^53 keep all digits.
  void sample(const Labels& labels, double value);
  void sample(const Labels& labels, const Histogram& histogram);
  std::string take() { return std::move(text_); }

 private:
  void line(std::string_view suffix, const Labels& labels, const std::string& value);

  std::string name_, text_;
};

struct DaemonFigures {
  std::string version;
  double uptime_s = 0;
  std::vector<std::pair<std::string, DeviceFigures>> sonars;  // name and figures
  PoseCounters poses;
  std::vector<LinkFigures> links;                                                      // MAVLink links
  std::uint64_t clients_now = 0, refused_for_places = 0, refused_for_descriptors = 0;  // sums over all sonars
  std::vector<ViewerFigures> viewers;                                                  // viewers of the live view
  ProcessFigures process;
  std::vector<std::pair<std::string, std::uint64_t>> active_faults;          // by sonar
  std::vector<std::pair<std::string_view, std::uint64_t>> fault_injections;  // by code, since the start
  std::uint64_t fault_entries_lost = 0;                                      // entries that are not in the journal's file
};
std::string metrics_text(const DaemonFigures& figures);

}  // namespace sonar
