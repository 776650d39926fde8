#include "tests/oracles/record.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <set>
#include <sstream>

namespace sonar::test {
namespace {

std::string running_test() {
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  return info ? std::string(info->test_suite_name()) + "." + info->name() : "no test";
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

/// Writes a number in the form that Python's json module reads: NaN and Infinity are allowed.
std::string number_text(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  std::ostringstream out;
  out << std::setprecision(9) << value;
  return out.str();
}

/// There is one file for each oracle and test, because ctest runs tests at the same time, each in its own process. The first
/// record of a process replaces the record of an earlier run of the same test.
void append(int number, const std::string& line) {
  const char* folder = std::getenv("SONARD_ORACLES");
  if (folder == nullptr || *folder == 0) return;
  std::string name = running_test();
  for (char& c : name) {
    if (c == '/') c = '_';  // names of parametrised tests contain it
  }
  std::ostringstream file;
  file << std::setw(2) << std::setfill('0') << number << '-' << name << ".jsonl";
  static std::set<std::string> begun;
  const bool fresh = begun.insert(file.str()).second;
  std::filesystem::create_directories(folder);
  std::ofstream out(std::filesystem::path(folder) / file.str(), fresh ? std::ios::trunc : std::ios::app);
  out << line << '\n';
  if (!out.flush()) ADD_FAILURE() << "cannot write " << folder << "/" << file.str();
}

struct Record {
  int number;
  const std::string& what;
  const char* kind;
  double expected, measured, tolerance;
  const std::string& unit;
  bool pass;
};

void keep(const Record& r, Place where) {
  std::ostringstream line;
  line << "{\"oracle\": " << r.number << ", \"what\": " << quoted(r.what) << ", \"kind\": \"" << r.kind
       << "\", \"expected\": " << number_text(r.expected) << ", \"measured\": " << number_text(r.measured)
       << ", \"tolerance\": " << number_text(r.tolerance) << ", \"unit\": " << quoted(r.unit)
       << ", \"pass\": " << (r.pass ? "true" : "false") << ", \"test\": " << quoted(running_test()) << "}";
  append(r.number, line.str());
  if (!r.pass) ADD_FAILURE_AT(where.file, where.line) << "oracle out of tolerance: " << line.str();
}

}  // namespace

void record_oracle(int number, const std::string& what, double expected, double measured, double tolerance,
                   const std::string& unit, Place where) {
  const bool pass = std::abs(measured - expected) <= tolerance;
  keep({number, what, "equal", expected, measured, tolerance, unit, pass}, where);
}

void record_at_least(int number, const std::string& what, double bound, double measured, const std::string& unit, Place where) {
  keep({number, what, "at_least", bound, measured, 0, unit, measured >= bound}, where);
}

void record_below(int number, const std::string& what, double bound, double measured, const std::string& unit, Place where) {
  keep({number, what, "below", bound, measured, 0, unit, measured < bound}, where);
}

}  // namespace sonar::test
