#!/usr/bin/env bash
# The load tests in full length, about five minutes on a machine that does nothing else; figures go where SONARD_RELIABILITY says.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

build release load_test sonard || exit
failed=0
build/release/tests/load/load_test --gtest_brief=1 || failed=1
for test in descriptors real_pings beside_driver; do
  SONARD_BUILD=$PWD/build/release python3 -B tests/load/${test}_test.py || failed=1
done
exit $failed
