#include "core/motion/trajectory_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/motion/columns.hpp"
#include "core/motion/stamp.hpp"
#include "core/text/file_kind.hpp"
#include "core/text/nearest.hpp"

namespace sonar::motion {
namespace {

// Limits at which the reader stops early if a file is not a trajectory.
constexpr std::size_t most_bodies = 256;
constexpr std::size_t most_bytes = std::size_t{1} << 30;
constexpr std::uint64_t memory_of_a_line = 200;  // bytes: a stamp, a pose and two velocities, twice while a vector grows

constexpr std::array<std::string_view, 5> format_names{"auto", "csv", "tum", "euroc", "kitti"};
constexpr std::array<std::string_view, 2> frame_names{"ENU_FLU", "NED_FRD"};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

/// Splits a line into words. The search functions of strings are slow for words as short as numbers; therefore the loop is
/// written by hand. `between` is a comma, a semicolon or a blank; a blank stands for any number of blanks and tabs. An empty
/// last word is dropped.
void split(std::string_view line, char between, Words& words) {
  const bool blanks = between == ' ';
  words.clear();
  for (std::size_t at = 0; at <= line.size();) {
    std::size_t end = at;
    while (end < line.size() && !(blanks ? is_blank(line[end]) : line[end] == between)) ++end;
    const std::string_view word = line.substr(at, end - at);
    if (!blanks || !word.empty()) words.push_back(blanks ? word : trimmed(word));
    at = end + 1;
  }
  if (words.size() > 1 && words.back().empty()) words.pop_back();
}

bool is_comment(std::string_view line) {
  return line.front() == '#' || line.starts_with("//") || line.starts_with("% ") || line == "%";
}

/// True for a number; this distinguishes a line of numbers from a header.
bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double v = 0;
  return std::from_chars(word.data(), word.data() + word.size(), v).ptr == word.data() + word.size() && !word.empty();
}

std::optional<Frame> frame_called(std::string_view word) {
  std::string upper(word.substr(0, 16));
  // Converts only ASCII letters, because toupper() depends on the locale.
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  for (std::size_t i = 0; i < frame_names.size(); ++i)
    if (upper == frame_names[i]) return static_cast<Frame>(i);
  return std::nullopt;
}

/// The points of one body while the file is read. Their times are still the stamps of the file.
struct Track {
  std::string body;
  Points points = {};
  ImplausibleAngle largest_angle = {};
  TurnCount turns = {};
  ImplausibleAngle since_jump = {};  // the largest angle since the yaw last jumped; without the yaw if turns are counted

  void look_at(const RollPitchYaw& written, std::int64_t stamp_ns) {
    if (!turns.add(written.yaw_rad, Time(Ns(stamp_ns)))) largest_angle.include(std::exchange(since_jump, {}));
    since_jump.include(angle_beyond_radians(written));
    largest_angle.include(angle_beyond_radians(written, true));
    if (turns.has_counted()) since_jump = {};
  }
  ImplausibleAngle angle() const {
    ImplausibleAngle all = largest_angle;
    all.include(since_jump);
    return all;
  }
};

class Reader {
 public:
  Reader(const std::string& name, const ReadOptions& options) : name_(name), options_(options), format_(options.format) {}

  Result<TrajectoryFile> run(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
    line_end_ = text.find('\n') == std::string_view::npos ? '\r' : '\n';
    // Reads up to the first error, because later errors are mostly its consequences.
    for (std::size_t at = 0; at < text.size() && wrong_.empty();) {
      const std::size_t end = std::min(text.find(line_end_, at), text.size());
      ++line_;
      from_here_ = text.substr(at);
      take(trimmed(text.substr(at, end - at)));
      at = end + 1;
    }
    if (wrong_.empty()) check_whole_file();
    if (!wrong_.empty()) return failure(ErrorKind::bad_data, wrong_);
    return finished();
  }

 private:
  void set_error(const std::string& what) {
    if (wrong_.empty()) wrong_ = name_ + ":" + std::to_string(line_) + ": " + what;
  }

  void take(std::string_view line) {
    if (line.empty()) return;
    if (is_comment(line)) return take_comment(line);
    if (columns_) {
      split(line, between_, words_);
    } else {
      // The first line decides the separator. Through begin_table() it also decides the format and the columns.
      between_ = line.find(';') != line.npos ? ';' : line.find(',') != line.npos ? ',' : ' ';
      split(line, between_, words_);
      if (begin_table()) return;
      if (!wrong_.empty()) return;
    }
    if (words_.size() != columns_->count())
      return set_error(std::to_string(words_.size()) + " values instead of " + std::to_string(columns_->count()));
    if (rows_ == 0) guess_unit();
    Row row;
    if (const auto wrong = columns_->refuse(words_, row)) return set_error(*wrong);
    if (format_ == Format::kitti) {
      // Each time [ns] is computed from the line number, because a sum of intervals would drift.
      const double stamp_ns = static_cast<double>(rows_) * 1e9 / *options_.rate_hz;
      if (stamp_ns > static_cast<double>(farthest_stamp_ns)) return set_error("the time is beyond 146 years");
      row.stamp_ns = std::llround(stamp_ns);
    }
    keep(row);
    ++rows_;
  }

  void guess_unit() {
    if (columns_->says_unit()) return;
    constexpr std::size_t most_lines = 1000;
    FirstLines first;
    Words words;
    std::string_view of;
    for (std::size_t at = 0; at < from_here_.size() && first.stamps.size() < most_lines;) {
      const std::size_t end = std::min(from_here_.find(line_end_, at), from_here_.size());
      const std::string_view line = trimmed(from_here_.substr(at, end - at));
      at = end + 1;
      if (line.empty() || is_comment(line)) continue;
      split(line, between_, words);
      double stamp = 0;
      Vec3d position_m;
      std::string_view body;
      if (words.size() != columns_->count() || !columns_->peek(words, stamp, position_m, body)) break;
      if (first.stamps.empty()) of = body;
      if (body != of) continue;
      first.stamps.push_back(stamp);
      first.positions.push_back(position_m);
    }
    const int usual = columns_->power(), by_steps = first.stamps.empty() ? usual : unit_by_steps(first, usual);
    columns_->guess_unit(words_);  // from the number of digits of the first stamp
    unit_by_steps_ = by_steps != usual && by_steps != columns_->power();
    if (unit_by_steps_) columns_->set_power(by_steps);
  }

  /// Sets the columns. Returns true if the line is a header. If it returns false, the line has numbers, or there is an error.
  bool begin_table() {
    const bool numbers = is_number(words_.front());
    if (format_ == Format::automatic) format_ = guessed(numbers);
    if (!wrong_.empty()) return false;
    if (options_.rate_hz && format_ != Format::kitti) set_error("the lines have times; remove rate_hz");
    switch (format_) {
      case Format::tum:
        columns_ = Columns::tum();
        return false;
      case Format::euroc:
        if (const std::size_t n = words_.size(); n != 8 && n != 11 && n != 17)
          set_error(std::to_string(n) + " values instead of 8, 11 or 17");
        columns_ = Columns::euroc(words_.size());
        return false;
      case Format::kitti:
        if (!(options_.rate_hz.value_or(0) > 0))
          set_error("KITTI lines have no time; give the number of lines per second (rate_hz or --pose-rate)");
        columns_ = Columns::kitti();
        return false;
      default:
        break;
    }
    if (numbers) {
      set_error("a CSV file begins with a line of column names: t_s,x_m,y_m,z_m,qw,qx,qy,qz");
      return false;
    }
    Columns columns = Columns::tum();
    if (const auto wrong = Columns::refuse_header(words_, columns)) set_error(*wrong);
    columns_ = columns;
    return true;
  }

  Format guessed(bool numbers) {
    // Without a header, commas mean EuRoC, 12 values mean KITTI, and 8 values mean TUM.
    if (!numbers) return Format::csv;
    if (between_ != ' ') return words_.size() == 8 && has_seconds(words_.front()) ? Format::tum : Format::euroc;
    if (words_.size() == 12) return Format::kitti;
    if (words_.size() != 8) set_error(std::to_string(words_.size()) + " values instead of 8 (TUM) or 12 (KITTI)");
    return Format::tum;
  }

  /// True for a stamp in seconds. EuRoC stamps are in nanoseconds: whole numbers, from some programs numbers such as 1.4e+18.
  static bool has_seconds(std::string_view word) {
    constexpr std::int64_t least_ns = 100'000'000'000'000'000;  // in 1973
    return word.find('.') != word.npos && nanoseconds_of_nanoseconds(word).value_or(0) < least_ns;
  }

  /// Comments without a frame or an origin are ignored.
  void take_comment(std::string_view line) {
    Words words;
    if (const std::size_t word = line.find("origin:"); word != std::string_view::npos) {
      split(line.substr(word + 7), ',', words);
      if (words.size() >= 2 && is_number(words[0])) {
        double latitude = 0, longitude = 0;
        std::from_chars(words[0].data(), words[0].data() + words[0].size(), latitude);
        std::from_chars(words[1].data(), words[1].data() + words[1].size(), longitude);
        origin_ = Geodetic{rad_from_deg(latitude), rad_from_deg(longitude), 0};
      }
    }
    const std::size_t word = line.find("frame:");
    if (word == std::string_view::npos) return;
    split(line.substr(word + 6), ' ', words);
    const auto frame = words.empty() ? std::nullopt : frame_called(words.front());
    if (!frame) return set_error("the frame must be ENU_FLU or NED_FRD");
    // Contradictory frames are an error, because the frame that the file states must not be ignored silently.
    if (frame_.value_or(*frame) != *frame) return set_error("an earlier comment names another frame; a file has one frame");
    if (options_.frame.value_or(*frame) != *frame)
      return set_error("the file states the frame " + std::string(name_of(*frame)) + ", but " +
                       std::string(name_of(*options_.frame)) + " was requested");
    frame_ = frame;
  }

  void keep(const Row& row) {
    Track* const track = track_of(row.body);
    if (track == nullptr) return set_error("more than " + std::to_string(most_bodies) + " bodies");
    Points& p = track->points;
    if (!p.times.empty() && Ns(row.stamp_ns) < p.times.back())
      return set_error("the time is earlier than the previous one" +
                       (row.body.empty() ? std::string() : " for " + in_quotes(row.body)));
    // A pose replaces an earlier one with the same time, as for live poses. So no interval between poses has length 0.
    if (!p.times.empty() && Ns(row.stamp_ns) == p.times.back()) {
      ++replaced_;
      p.times.pop_back(), p.poses.pop_back();
      if (columns_->has_velocity()) p.velocities_mps.pop_back();
      if (columns_->has_angular_velocity()) p.angular_velocities_radps.pop_back();
    }
    p.times.emplace_back(row.stamp_ns);
    p.poses.push_back(row.pose);
    track->look_at(row.written, row.stamp_ns);
    if (columns_->has_velocity()) p.velocities_mps.push_back(row.velocity_mps);
    if (columns_->has_angular_velocity()) p.angular_velocities_radps.push_back(row.angular_velocity_radps);
  }

  Track* track_of(std::string_view body) {
    // Consecutive lines mostly belong to the same body.
    if (last_ < tracks_.size() && tracks_[last_].body == body) return &tracks_[last_];
    for (last_ = 0; last_ < tracks_.size(); ++last_)
      if (tracks_[last_].body == body) return &tracks_[last_];
    if (tracks_.size() == most_bodies) return nullptr;
    return &tracks_.emplace_back(Track{.body = std::string(body)});
  }

  void check_whole_file() {
    if (tracks_.empty()) {
      wrong_ = name_ + ": the file has no poses; write one pose per line (docs/poses.md)";
    } else if (!frame_ && !options_.frame) {
      wrong_ = name_ +
               ": the file does not state the frame of its poses; begin it with a line \"# frame: ENU_FLU\" or \"# frame: "
               "NED_FRD\", or give the frame with the file's name (docs/poses.md)";
    }
  }

  TrajectoryFile finished() {
    TrajectoryFile file;
    file.format = format_;
    file.frame = frame_ ? *frame_ : *options_.frame;
    // Times of all bodies count from the earliest time in the file.
    Ns first = tracks_.front().points.times.front(), last = first;
    for (const Track& t : tracks_) {
      first = std::min(first, t.points.times.front());
      last = std::max(last, t.points.times.back());
    }
    file.begins_at = first;
    file.duration = last - first;
    file.origin = origin_;
    file.replaced = replaced_;
    file.unit = columns_->unit();
    file.unit_by_steps = unit_by_steps_;
    for (Track& t : tracks_) {
      for (Ns& at : t.points.times) at -= first;
      // Converts poses to ENU and FLU, which all other code uses (docs/glossary.md).
      if (file.frame == Frame::ned_frd) turn_to_enu_flu(t.points);
      file.bodies.push_back(
          {std::move(t.body), std::make_shared<const Trajectory>(std::move(t.points), file.duration), t.angle()});
    }
    return file;
  }

  static void turn_to_enu_flu(Points& p) {
    for (Pose& pose : p.poses) pose = enu_flu_from_ned_frd(pose);
    for (Vec3d& v : p.velocities_mps) v = enu_from_ned(v);
    for (Vec3d& w : p.angular_velocities_radps) w = flu_from_frd(w);
  }

  const std::string& name_;
  const ReadOptions& options_;
  Format format_;
  std::optional<Frame> frame_;
  std::optional<Geodetic> origin_;
  std::optional<Columns> columns_;
  char between_ = ' ', line_end_ = '\n';
  std::string_view from_here_;  // the text from the current line on
  bool unit_by_steps_ = false;
  Words words_;
  std::size_t line_ = 0, rows_ = 0, last_ = 0, replaced_ = 0;
  std::vector<Track> tracks_;
  std::string wrong_;
};

Result<std::string> text_of(const std::filesystem::path& file) {
  auto text = read_regular(file, most_bytes);
  if (text && text->size() > most_bytes)
    return failure(ErrorKind::bad_data, file.string() + ": more than a gigabyte of poses; split the file");
  return text;
}

/// Logs and recordings have zero bytes near their beginning; lines of numbers have none.
bool is_log(std::string_view text) {
  constexpr std::size_t beginning = 4096;
  std::string_view begin = text.substr(0, beginning);
  begin.remove_prefix(std::min(begin.find_first_not_of("\xef\xbb\xbf \t\r\n"), begin.size()));
  // NMEA sentences of a GPS, XML such as GPX and KML, and JSON. The converter reads some of them and explains how to convert
  // the others.
  const bool other_text = begin.starts_with("$G") || begin.starts_with("<") || begin.starts_with("{");
  return other_text || begin.find('\0') != std::string_view::npos;
}

}  // namespace

std::string_view name_of(Format format) { return format_names[static_cast<std::size_t>(format)]; }
std::string_view name_of(Frame frame) { return frame_names[static_cast<std::size_t>(frame)]; }

Result<TrajectoryFile> parse_trajectories(std::string_view text, const std::string& name, const ReadOptions& options) {
  return Reader(name, options).run(text);
}

Result<TrajectoryFile> load_trajectories(const std::filesystem::path& file, const ReadOptions& options) {
  const auto text = text_of(file);
  if (!text) return tl::make_unexpected(text.error());
  if (const auto kind = text::unusable_kind(*text, text::FileUse::poses); !kind.empty())
    return failure(ErrorKind::bad_data, file.string() + ": " + kind);
  if (is_log(*text))
    return failure(
        ErrorKind::bad_data,
        file.string() +
            ": not lines of poses; convert a log or recording: python3 -m sonard_client.convert FILE -o OUT.csv (without "
            "a horizontal position --at NORTH,EAST places the vehicle, and --dead-reckon M/S moves it)");
  const auto lines = static_cast<std::uint64_t>(std::count(text->begin(), text->end(), '\n')) + 1;
  if (auto room = check_memory_for(file.string(), memory_of_a_line * lines); !room) return tl::make_unexpected(room.error());
  return parse_trajectories(*text, file.string(), options);
}

Result<std::shared_ptr<const Trajectory>> trajectory_of(const TrajectoryFile& file, const std::string& name,
                                                        const std::string& body) {
  std::vector<std::string_view> names;
  for (const TrajectoryFile::Body& b : file.bodies) {
    if (b.name == body || (body.empty() && file.bodies.size() == 1)) return b.trajectory;
    names.push_back(b.name);
  }
  if (names.front().empty())
    return failure(ErrorKind::bad_data, name + ": the file has one body, which has no name; remove the key \"body\"");
  if (body.empty())
    return failure(ErrorKind::bad_data, name + ": the file has several bodies; choose one with the key \"body\"" +
                                            text::suggestion("", names, "there are"));
  return failure(ErrorKind::bad_data,
                 name + ": no body is called " + in_quotes(body) + text::suggestion(body, names, "there are"));
}

}  // namespace sonar::motion
