#!/bin/sh
# Installs what is missing, builds, and runs the tests: tests/run.sh [quick|full|all]
. "$(dirname "$0")/prepare.sh"
install_packages
build all
case "${1:-all}" in
  quick) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" -L quick ;;
  full) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" -L full ;;
  all) ctest --test-dir "$PEAT_BUILD" --output-on-failure -j "$JOBS" ;;
  *) echo "usage: tests/run.sh [quick|full|all]" >&2; exit 1 ;;
esac
