// `sonard bench`: times whole pings, from pose to framed bytes, case by case and stage by stage, as a table and as JSON.
// The cases are those of bench_cases.hpp; figures depend on the machine, so the processor is printed with them.
#pragma once

namespace sonar {

/// argv[0] is the word "bench". Returns an exit code.
int run_bench(int argc, char** argv);

}  // namespace sonar
