#!/bin/sh
# Installs what is missing, builds, and runs the tests: tests/run.sh [quick|full|all]
. "$(dirname "$0")/prepare.sh"
install_packages
build all
case "${1:-all}" in
  quick) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" -L quick ;;
  full) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" -L full ;;
  # The whole of bad_input is among them.
  all) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" -E "^bad_input_some$" ;;
  *) echo "usage: tests/run.sh [quick|full|all]" >&2; exit 1 ;;
esac
