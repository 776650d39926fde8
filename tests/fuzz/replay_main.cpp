// Replaces libFuzzer's main in ordinary builds: runs a fuzz entry point with no bytes, with its seeds, and with inputs made from
// them and from the dictionary. These inputs are the same in every run.
// usage: NAME_fuzz [-runs=N] [-dict=FILE] [-only=NUMBER] [seed files and folders]
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/mutator.hpp"

#if defined(__SANITIZE_ADDRESS__)  // g++
#define SONARD_DEATH_CALLBACK
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)  // clang
#define SONARD_DEATH_CALLBACK
#endif
#endif
#if defined(SONARD_DEATH_CALLBACK)
#include <sanitizer/common_interface_defs.h>
#endif

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using sonar::fuzz::Input;

Input contents_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    std::fprintf(stderr, "%s: cannot be opened\n", file.c_str());
    std::exit(66);
  }
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return {text.begin(), text.end()};
}

void add_seeds(const std::filesystem::path& path, std::vector<Input>& seeds) {
  if (!std::filesystem::is_directory(path)) return seeds.push_back(contents_of(path));
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // folders have no order
  for (const auto& file : files) seeds.push_back(contents_of(file));
}

// ---- report of the input that ended the program

char last_report[64];
std::size_t last_report_size = 0;

void announce(const char* what, std::uint32_t number) {
  const int n = std::snprintf(last_report, sizeof last_report, "\nit was %s %u\n", what, number);
  last_report_size = static_cast<std::size_t>(std::max(0, n));
}
void print_last_report() {
  if (write(STDERR_FILENO, last_report, last_report_size) < 0) _exit(70);
}
void on_signal(int number) {
  print_last_report();
  signal(number, SIG_DFL);
  raise(number);
}

void run(const Input& input) {
  // A buffer of exactly the input's size, so that a sanitizer detects a read beyond it.
  const Input exact(input);
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

}  // namespace

int main(int argc, char** argv) {
  std::uint32_t runs = 0, only = ~0u;
  std::vector<Input> seeds, words;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.starts_with("-runs=")) {
      runs = static_cast<std::uint32_t>(std::strtoul(argv[i] + 6, nullptr, 10));
    } else if (argument.starts_with("-only=")) {
      only = static_cast<std::uint32_t>(std::strtoul(argv[i] + 6, nullptr, 10));
    } else if (argument.starts_with("-dict=")) {
      words = sonar::fuzz::dictionary_from(argv[i] + 6);
      if (words.empty()) return std::fprintf(stderr, "%s: no words in this dictionary\n", argv[i] + 6), 65;
    } else {
      add_seeds(argument, seeds);
    }
  }
#if defined(SONARD_DEATH_CALLBACK)
  __sanitizer_set_death_callback(print_last_report);
#else
  for (const int number : {SIGSEGV, SIGFPE, SIGBUS, SIGILL}) signal(number, on_signal);
#endif
  signal(SIGABRT, on_signal);

  if (only == ~0u) {
    announce("the empty input", 0);
    LLVMFuzzerTestOneInput(nullptr, 0);
  }
  for (std::uint32_t i = 0; i < seeds.size() && only == ~0u; ++i) {
    announce("seed", i);
    run(seeds[i]);
  }
  for (std::uint32_t number = 0; number < runs; ++number) {
    if (only != ~0u && number != only) continue;
    announce("made-up input", number);
    run(sonar::fuzz::made_up(number, seeds, words));
  }
  std::printf("%zu seeds and %u made-up inputs survived\n", seeds.size(), only == ~0u ? runs : 1);
}
