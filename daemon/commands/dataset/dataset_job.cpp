#include "daemon/commands/dataset/dataset_job.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/dataset/shards.hpp"

namespace sonar::dataset {
namespace {

void read_constraints(const text::Node& node, Constraints& c) {
  text::Map keys = node.map();
  c.in_view = keys.optional("in_view").texts();
  const text::Node above = keys.optional("above_bed"), bed = keys.optional("bed");
  c.above_bed = above.texts();
  c.no_overlap = keys.optional("no_overlap").texts();
  c.bed = bed.text_or({}, 64);
  c.tries = static_cast<std::uint32_t>(keys.optional("tries").integer_or(100, 1, 100000));
  if (!c.above_bed.empty() && c.bed.empty()) above.fail("needs bed: the name of the object that is the bed");
}

/// Returns the position of the keys of a root in flow style ({a: 1, ..}); nullopt if the root is in block style.
std::optional<std::size_t> flow_root(std::string_view text) {
  std::size_t at = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  while (at < text.size() && (text[at] == '#' || text[at] == '%' || text.substr(at).starts_with("---")))
    at = text.find_first_not_of(" \t\r\n", text[at] == '-' ? at + 3 : text.find('\n', at));
  if (at >= text.size() || text[at] != '{') return std::nullopt;
  return at + 1;
}

/// Returns the lines of the key `scene` of YAML in block style; empty if they cannot be found.
std::string_view scene_lines(std::string_view text) {
  if (flow_root(text)) return {};
  std::size_t from = text.starts_with("scene:") ? 0 : text.find("\nscene:");
  if (from == std::string_view::npos) return {};
  if (from > 0) ++from;
  std::size_t end = text.find('\n', from);
  while (end != std::string_view::npos && end + 1 < text.size() &&
         std::string_view(" \t\r\n#-}]").find(text[end + 1]) != std::string_view::npos)
    end = text.find('\n', end + 1);
  return text.substr(from, end == std::string_view::npos ? std::string_view::npos : end + 1 - from);
}

/// Returns the numbers of the draws as a sweep of one step, so that formulas and `let` use them as in a render file.
std::string sweep_of(const Draws& draws) {
  const std::string sweep = text::joined(
      draws.numbers, ", ", [](const auto& number) { return number.first + ": [" + text::format("%.17g", number.second) + "]"; });
  return sweep.empty() ? "" : "sweep: {" + sweep + "}";
}

/// Returns the text of a ping's scene with all its numbers. It is equal for equal scenes. Each ping gets a different text if the
/// numbers cannot be computed (the reader of the file reports that) or the lines of the scene are not known.
std::string scene_key_of(const DatasetJob& job, const Draws& draws, const std::string& lines, std::uint64_t number) {
  render::Values values = draws.numbers;
  for (const auto& [name, formula] : job.formulas)
    if (const auto value = render::evaluate(put_words(formula, draws.words), values)) values[name] = *value;
  const auto filled = render::substitute(lines, values, job.source);
  return filled && !lines.empty() ? *filled : lines + std::to_string(number);
}

std::string with_sweep(std::string text, const std::string& sweep) {
  if (sweep.empty()) return text;
  if (const auto at = flow_root(text)) return text.insert(*at, sweep + ", ");
  return text + "\n" + sweep + "\n";
}

/// Hides the objects that the counts leave out, or all targets in a negative ping. Draws select the hidden objects; the visible
/// ones keep their numbers.
Result<std::shared_ptr<const Scene>> with_counts(const DatasetJob& job, const text::Document& filled, const DrawnPing& ping,
                                                 std::uint64_t number) {
  auto changed = std::make_shared<Scene>(*ping.job.scene);
  const auto hide = [&](const std::string& name, std::int64_t keep) {
    std::vector<std::pair<double, Object*>> named;
    for (Object& o : changed->objects)
      if (is_named(o, name))
        named.emplace_back(draw_uniform(job.seed, number, ping.attempt, name + "#" + std::to_string(named.size())), &o);
    std::ranges::sort(named, {}, &std::pair<double, Object*>::first);
    for (auto& [chance, object] : named)
      if (keep-- <= 0) object->visible = false;
  };
  text::Map root = filled.root();
  const auto known = names_of(*changed);
  for (const auto& [name, count] : root.optional("counts").map().entries()) {
    if (!known.contains(name)) count.fail("no object of that name or label");
    hide(name, count.integer(0, 100000));
  }
  if (const auto error = filled.error()) return tl::make_unexpected(*error);
  if (ping.negative)
    for (const std::string& name : job.targets) hide(name, 0);
  return std::shared_ptr<const Scene>(std::move(changed));
}

/// Finds names of files among the words of the YAML text, with each word of `variations` filled in.
void add_files_in(std::string_view text, const std::filesystem::path& folder, const std::vector<Variation>& variations,
                  std::set<std::filesystem::path>& seen, std::vector<NamedFile>& files) {
  const auto add_file = [&](const std::string& word) {
    const std::filesystem::path file = folder / word;
    std::error_code ec;
    if (!std::filesystem::is_regular_file(file, ec) || !seen.insert(file).second) return;
    files.push_back({word, file, digest_of_file(file).value_or("unreadable")});
    if (file.extension() != ".yaml" && file.extension() != ".yml") return;
    if (const auto more = read_regular(file, text::YamlLimits{}.max_bytes))
      add_files_in(*more, file.parent_path(), {}, seen, files);
  };
  constexpr std::string_view between = " \t\r\n,[]{}\"'";
  for (std::size_t at = text.find_first_not_of(between); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(between, at), text.size());
    const std::string word(text.substr(at, end - at));
    at = text.find_first_not_of(between, end);
    if (word.find('$') == std::string::npos) add_file(word);
    for (const Variation& v : variations)
      for (const std::string& choice : v.words)
        if (std::string filled = put_words(word, {{v.name, choice}}); filled != word) add_file(filled);
  }
}

std::string replaced(std::string text, std::string_view lines, std::string_view instead) {
  const std::size_t at = text.find(lines);
  return text.replace(at, lines.size(), instead);
}

}  // namespace

Result<DatasetJob> parse_job(std::string text, const std::string& name, const std::filesystem::path& folder) {
  const auto document = text::parse_yaml(text, name, {.error_kind = ErrorKind::config});
  if (!document) return tl::make_unexpected(document.error());
  text::Map root = document->root();
  DatasetJob job;
  job.source = name, job.folder = folder;
  job.name = std::filesystem::path(name).stem().string();
  job.about = root.optional("about").text_or("", 4096);
  text::Map set = root.required("dataset").map();
  job.pings = static_cast<std::uint64_t>(set.required("pings").integer(1, static_cast<std::int64_t>(most_pings)));
  job.shard_pings =
      static_cast<std::uint64_t>(set.optional("shard").integer_or(1024, 1, static_cast<std::int64_t>(most_shard_pings)));
  job.seed = Seed{set.optional("seed").unsigned_integer_or(1)};
  job.negatives = set.optional("negatives").number_or(0, text::Range::between(0, 1));
  const text::Node targets = set.optional("targets");
  job.targets = targets.texts();
  job.fan = set.optional("fan").boolean_or(false);
  job.license = set.optional("license").text_or("not stated", 200);
  if (job.negatives > 0 && job.targets.empty())
    set.optional("negatives").fail("needs targets: the names or labels that such pings lack");
  job.variations = read_variations(root.optional("vary"));
  for (const auto& [name_of, formula] : root.optional("let").map().entries())
    job.formulas.emplace_back(name_of, formula.text(1000));
  read_constraints(root.optional("constraints"), job.constraints);
  // The keys of a render file are read when a ping is drawn.
  for (const char* key : {"name", "scene", "water", "sonar", "poses", "engine", "seed", "counts"}) root.optional(key);
  if (root.has("sweep")) root.optional("sweep").fail("is for render files; a data set has vary:");
  if (root.has("expect")) root.optional("expect").fail("is for render files");
  if (const auto error = document->finish()) return tl::make_unexpected(*error);
  job.text = std::move(text);
  return job;
}

Result<DatasetJob> load_job(const std::filesystem::path& file) {
  auto text = read_regular(file, text::YamlLimits{}.max_bytes);
  if (!text) return tl::make_unexpected(text.error());
  return parse_job(*std::move(text), file.string(), file.parent_path());
}

std::vector<NamedFile> named_files(const DatasetJob& job) {
  std::set<std::filesystem::path> seen;
  std::vector<NamedFile> files;
  add_files_in(job.text, job.folder, job.variations, seen, files);
  return files;
}

Result<DrawnPing> draw_ping(const DatasetJob& job, std::uint64_t number, const KnownScene& known) {
  DrawnPing ping;
  ping.negative = job.negatives > 0 && draw_uniform(job.seed, number, 0, "negatives:") < job.negatives;
  Unmet unmet;
  for (ping.attempt = 0; ping.attempt < job.constraints.tries; ++ping.attempt) {
    ping.draws = draw(job.variations, job.seed, number, ping.attempt);
    std::string filled = put_words(job.text, ping.draws.words);
    const std::string lines(scene_lines(filled));
    ping.scene_key = scene_key_of(job, ping.draws, lines, number);
    const bool is_known = known.scene && known.key == ping.scene_key;
    if (is_known) filled = replaced(std::move(filled), lines, "scene: {objects: []}\n");
    const auto outline =
        text::parse_yaml(with_sweep(std::move(filled), sweep_of(ping.draws)), job.source, {.error_kind = ErrorKind::config});
    if (!outline) return tl::make_unexpected(outline.error());
    auto jobs = render::read_render_jobs(*outline, job.source, job.folder, known.shapes);
    if (!jobs) return tl::make_unexpected(jobs.error());
    ping.job = std::move(jobs->front());
    if (is_known) ping.job.scene = known.scene;
    ping.whole_scene = ping.job.scene;
    // Names are looked up before objects are hidden.
    if (std::string why = why_unknown(job.constraints, job.targets, *ping.job.scene); !why.empty())
      return failure(ErrorKind::config, job.source + ": " + why);
    const auto document = render::with_numbers(*outline, ping.job.values, job.source);
    if (!document) return tl::make_unexpected(document.error());
    auto scene = with_counts(job, *document, ping, number);
    if (!scene) return tl::make_unexpected(scene.error());
    ping.job.scene = *std::move(scene);
    if (meets(job.constraints, request_of(ping, number), *ping.job.scene, unmet)) return ping;
  }
  return failure(ErrorKind::config, job.source + ": ping " + std::to_string(number) + ": no draw of " +
                                        std::to_string(job.constraints.tries) + " meets the constraints: " + unmet.sentence() +
                                        "; widen the ranges of vary, or increase constraints.tries");
}

PingRequest request_of(const DrawnPing& ping, std::uint64_t number) {
  PingRequest request =
      render::make_request(ping.job, render::world_of(ping.job), PingNumber{static_cast<std::uint32_t>(number)}, Time{});
  request.switches.keep_truth = true;
  return request;
}

}  // namespace sonar::dataset
