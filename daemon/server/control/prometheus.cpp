#include "daemon/server/control/prometheus.hpp"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

namespace sonar {
namespace {

std::uint64_t entries_of(const char* folder) {
  DIR* const directory = opendir(folder);
  if (directory == nullptr) return 0;
  std::uint64_t count = 0;
  while (const dirent* entry = readdir(directory))
    if (entry->d_name[0] != '.') ++count;
  closedir(directory);
  return count;
}

}  // namespace

ProcessFigures figures_of_this_process() {
  ProcessFigures f;
  const auto page_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0, resident_pages = 0;
  if (statm >> pages >> resident_pages) f.resident_bytes = resident_pages * page_bytes;
  statm.close();
  const std::uint64_t descriptors = entries_of("/proc/self/fd");
  f.open_descriptors = descriptors > 0 ? descriptors - 1 : 0;  // without the descriptor used for counting
  f.threads = entries_of("/proc/self/task");
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) f.descriptor_limit = limit.rlim_cur;
  rusage used{};
  if (getrusage(RUSAGE_SELF, &used) == 0)
    f.processor_s = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
                    1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  return f;
}

namespace {

/// Escapes \ and newlines for the text format of Prometheus, and quotes in the values of labels.
std::string escaped(std::string_view text, bool label) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || (label && c == '"'))
      (out += '\\') += c;
    else if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out;
}

/// Writes whole numbers up to 2^53, the range that a double represents exactly, without an exponent.
std::string number(double value) {
  std::array<char, 32> text{};
  // Counters are whole numbers, and stay exact up to 2^53.
  const bool whole = std::trunc(value) == value && std::abs(value) < 9007199254740992.0;
  std::snprintf(text.data(), text.size(), whole ? "%.0f" : "%.9g", value);
  return text.data();
}

}  // namespace

void PrometheusText::family(std::string_view name, Type type, std::string_view help) {
  static constexpr std::array<const char*, 3> types{"counter", "gauge", "histogram"};
  name_ = name;
  text_ += "# HELP " + name_ + " " + escaped(help, false) + "\n";
  text_ += "# TYPE " + name_ + " " + types[static_cast<std::size_t>(type)] + "\n";
}

void PrometheusText::line(std::string_view suffix, const Labels& labels, const std::string& value) {
  text_ += name_;
  text_ += suffix;
  const char* before = "{";
  for (const auto& [key, text] : labels) {
    text_ += before;
    text_ += key;
    text_ += "=\"" + escaped(text, true) + "\"";
    before = ",";
  }
  text_ += labels.empty() ? " " : "} ";
  text_ += value + "\n";
}

void PrometheusText::sample(const Labels& labels, double value) { line("", labels, number(value)); }

// Buckets are cumulative: "le" counts all values up to its bound.
void PrometheusText::sample(const Labels& labels, const Histogram& histogram) {
  std::uint64_t up_to = 0;
  for (std::size_t i = 0; i <= Histogram::bounds_s.size(); ++i) {
    // Buckets are cumulative: each bucket contains the previous ones.
    up_to += histogram.counts()[i];
    const std::string bound = i < Histogram::bounds_s.size() ? number(Histogram::bounds_s[i]) : "+Inf";
    Labels with_bound = labels;
    with_bound.emplace_back("le", bound);
    line("_bucket", with_bound, std::to_string(up_to));
  }
  line("_sum", labels, number(histogram.sum_s()));
  line("_count", labels, std::to_string(histogram.count()));
}

// ---- sonard's metrics

namespace {

using Type = PrometheusText::Type;

struct SonarFamily {
  const char* name;
  Type type;
  const char* help;
  double (*value)(const DeviceFigures&);
};
constexpr SonarFamily sonar_families[] = {
    {"sonard_ticks_total", Type::counter, "Number of times at which a ping was due.",
     [](const DeviceFigures& f) { return static_cast<double>(f.ticks); }},
    {"sonard_pings_total", Type::counter, "Pings simulated.",
     [](const DeviceFigures& f) { return static_cast<double>(f.pings); }},
    {"sonard_pings_refused_total", Type::counter, "Pings that the engine could not make.",
     [](const DeviceFigures& f) { return static_cast<double>(f.refused); }},
    {"sonard_pings_unwanted_total", Type::counter,
     "Pings that were ready after their client had left or had changed its settings.",
     [](const DeviceFigures& f) { return static_cast<double>(f.unwanted); }},
    {"sonard_pings_out_of_water_total", Type::counter, "Pings of noise only: the sonar was above the sea surface.",
     [](const DeviceFigures& f) { return static_cast<double>(f.out_of_water); }},
    {"sonard_pings_served_total", Type::counter, "Pings written whole to at least one client.",
     [](const DeviceFigures& f) { return static_cast<double>(f.served); }},
    {"sonard_pings_offered_total", Type::counter, "Pings, counted for each client to which they were offered.",
     [](const DeviceFigures& f) { return static_cast<double>(f.offered); }},
    {"sonard_pings_sent_total", Type::counter, "Pings written whole, counted for each client.",
     [](const DeviceFigures& f) { return static_cast<double>(f.sent); }},
    {"sonard_outbox_pings", Type::gauge, "Pings that wait for slow clients now.",
     [](const DeviceFigures& f) { return static_cast<double>(f.waiting); }},
    {"sonard_clients", Type::gauge, "Clients that are served now.",
     [](const DeviceFigures& f) { return static_cast<double>(f.clients_now); }},
    {"sonard_clients_queued", Type::gauge, "Clients that wait for a connection slot now.",
     [](const DeviceFigures& f) { return static_cast<double>(f.clients_queued); }},
    {"sonard_clients_total", Type::counter, "Clients served since the start.",
     [](const DeviceFigures& f) { return static_cast<double>(f.clients); }},
    {"sonard_clients_refused_total", Type::counter, "Clients refused because no connection slot was free.",
     [](const DeviceFigures& f) { return static_cast<double>(f.refused_clients); }},
    {"sonard_sent_bytes_total", Type::counter, "Bytes written to clients.",
     [](const DeviceFigures& f) { return static_cast<double>(f.bytes_written); }},
    {"sonard_received_bytes_total", Type::counter, "Bytes read from clients.",
     [](const DeviceFigures& f) { return static_cast<double>(f.bytes_read); }},
};

struct ReasonFamily {
  const char* name;
  const char* help;
  std::vector<std::pair<const char*, std::function<std::uint64_t(const DeviceFigures&)>>> reasons;
};
std::vector<ReasonFamily> reason_families() {
  const auto drop = [](DropReason why) {
    return [why](const DeviceFigures& f) { return f.dropped_by[static_cast<std::size_t>(why)]; };
  };
  return {{"sonard_pings_dropped_total",
           "Pings that a client did not get whole, because it was too slow, it left, sonard closed the connection, or a fault "
           "withheld them.",
           {{"slow", drop(DropReason::slow)},
            {"gone", drop(DropReason::gone)},
            {"stop", drop(DropReason::stop)},
            {"fault", drop(DropReason::fault)}}},
          {"sonard_ticks_skipped_total",
           "Ticks without a ping, because they were handled too late, the simulation was busy, another trigger waited, or poses "
           "were stale.",
           {{"late", [](const DeviceFigures& f) { return f.skipped.late; }},
            {"busy", [](const DeviceFigures& f) { return f.skipped.busy; }},
            {"trigger", [](const DeviceFigures& f) { return f.skipped.trigger; }},
            {"stale", [](const DeviceFigures& f) { return f.skipped_stale; }}}}};
}

struct TimeFamily {
  const char* name;
  const char* help;
  Histogram DeviceFigures::*times;
};
constexpr TimeFamily time_families[] = {
    {"sonard_simulation_seconds", "Wall time of one ping's simulation.", &DeviceFigures::simulation},
    {"sonard_tick_lateness_seconds", "Delay between the time at which a tick was due and its handling.",
     &DeviceFigures::lateness},
    {"sonard_ping_jitter_seconds", "Difference between the interval of two served pings and the interval of their ticks.",
     &DeviceFigures::jitter},
    {"sonard_ping_latency_seconds", "Time from a ping's tick until the kernel has its last byte, for each client.",
     &DeviceFigures::latency},
};

void write_sonars(PrometheusText& text, const DaemonFigures& figures) {
  for (const SonarFamily& family : sonar_families) {
    text.family(family.name, family.type, family.help);
    for (const auto& [name, f] : figures.sonars) text.sample({{"sonar", name}}, family.value(f));
  }
  for (const ReasonFamily& family : reason_families()) {
    text.family(family.name, Type::counter, family.help);
    for (const auto& [name, f] : figures.sonars)
      for (const auto& [reason, count] : family.reasons)
        text.sample({{"sonar", name}, {"reason", reason}}, static_cast<double>(count(f)));
  }
  for (const TimeFamily& family : time_families) {
    text.family(family.name, Type::histogram, family.help);
    for (const auto& [name, f] : figures.sonars) text.sample({{"sonar", name}}, f.*family.times);
  }
}

void write_poses(PrometheusText& text, const PoseCounters& poses) {
  text.family("sonard_poses_total", Type::counter, "Poses received, by outcome.");
  for (const auto& [outcome, count] :
       {std::pair("accepted", poses.accepted), std::pair("refused", poses.refused), std::pair("late", poses.late),
        std::pair("replaced", poses.replaced), std::pair("over_rate", poses.over_rate)})
    text.sample({{"outcome", outcome}}, static_cast<double>(count));
  text.family("sonard_poses_stale_total", Type::counter, "Number of times a pose source became stale.");
  text.sample({}, static_cast<double>(poses.stale));
}

void write_links(PrometheusText& text, const std::vector<LinkFigures>& links) {
  text.family("sonard_distances_sent_total", Type::counter, "DISTANCE_SENSOR messages sent on each MAVLink link.");
  for (const LinkFigures& link : links) text.sample({{"link", link.endpoint}}, static_cast<double>(link.sent));
  text.family(
      "sonard_distances_dropped_total", Type::counter,
      "DISTANCE_SENSOR messages that were not sent, because a fault withheld the ping, no vehicle was detected on the link, or "
      "the socket refused them.");
  for (const LinkFigures& link : links)
    for (const auto& [reason, count] :
         {std::pair("fault", link.withheld), std::pair("no_vehicle", link.unaddressed), std::pair("socket", link.refused)})
      text.sample({{"link", link.endpoint}, {"reason", reason}}, static_cast<double>(count));
}

void write_faults(PrometheusText& text, const DaemonFigures& figures) {
  text.family("sonard_faults_active", Type::gauge, "Injected faults that are active now.");
  for (const auto& [sonar, count] : figures.active_faults) text.sample({{"sonar", sonar}}, static_cast<double>(count));
  text.family("sonard_fault_injections_total", Type::counter, "Effects of injected faults, by kind.");
  for (const auto& [code, count] : figures.fault_injections) text.sample({{"kind", code}}, static_cast<double>(count));
  text.family("sonard_fault_entries_lost_total", Type::counter,
              "Entries of the fault journal that were not written to its file.");
  text.sample({}, static_cast<double>(figures.fault_entries_lost));
}

void write_process(PrometheusText& text, const DaemonFigures& figures) {
  const auto one = [&text](const char* name, Type type, const char* help, double value) {
    text.family(name, type, help);
    text.sample({}, value);
  };
  one("sonard_connections", Type::gauge, "Current connections to all sonars, including queued ones.",
      static_cast<double>(figures.clients_now));
  text.family("sonard_connections_refused_total", Type::counter, "Connections closed at once for a limit of the whole daemon.");
  text.sample({{"reason", "places"}}, static_cast<double>(figures.refused_for_places));
  text.sample({{"reason", "descriptors"}}, static_cast<double>(figures.refused_for_descriptors));
  one("sonard_viewers", Type::gauge, "Viewers of the live view now.", static_cast<double>(figures.viewers.size()));
  text.family("sonard_viewer_dropped_total", Type::counter, "Messages that newer ones replaced because the viewer was too slow.");
  for (const ViewerFigures& v : figures.viewers)
    for (const auto& [topic, count] : v.dropped)
      text.sample({{"viewer", v.address}, {"channel", topic}}, static_cast<double>(count));
  const ProcessFigures& p = figures.process;
  one("process_resident_memory_bytes", Type::gauge, "Resident memory size in bytes.", static_cast<double>(p.resident_bytes));
  one("process_open_fds", Type::gauge, "Open file descriptors.", static_cast<double>(p.open_descriptors));
  one("process_max_fds", Type::gauge, "Largest allowed number of file descriptors.", static_cast<double>(p.descriptor_limit));
  one("process_threads", Type::gauge, "Threads.", static_cast<double>(p.threads));
  one("process_cpu_seconds_total", Type::counter, "User and system time spent in seconds.", p.processor_s);
  one("sonard_uptime_seconds", Type::gauge, "Time since the start.", figures.uptime_s);
  text.family("sonard_build_info", Type::gauge, "Always 1; the version is a label.");
  text.sample({{"version", figures.version}}, 1);
}

}  // namespace

std::string metrics_text(const DaemonFigures& figures) {
  PrometheusText text;
  write_sonars(text, figures);
  write_poses(text, figures.poses);
  write_links(text, figures.links);
  write_faults(text, figures);
  write_process(text, figures);
  return text.take();
}

}  // namespace sonar
