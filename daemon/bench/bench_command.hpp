// `sonard bench`: times whole pings, from pose to framed bytes, case by case and stage by stage, and what else the goals name, as
// a table and as JSON. Cases are those of cases.hpp and findings.hpp; figures depend on the machine, so its processor is named.
#pragma once

namespace sonar {

/// argv[0] is the word "bench". Returns an exit code.
int run_bench(int argc, char** argv);

}  // namespace sonar
