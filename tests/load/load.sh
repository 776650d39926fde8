#!/usr/bin/env bash
# The load tests in full length, about ten minutes on an idle machine; the figures are written to the folder SONARD_RELIABILITY.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

build release load_test sonard in_own_network || exit
export SONARD_BUILD=$PWD/build/release
failed=0
alone() { "$SONARD_BUILD/tests/own_network/in_own_network" "$@" || failed=1; }
alone "$SONARD_BUILD/tests/load/load_test" --gtest_brief=1
for test in descriptors real_pings beside_driver; do alone python3 -B tests/load/${test}_test.py; done
alone python3 -B tests/load/strangers_test.py --measure 10
exit $failed
