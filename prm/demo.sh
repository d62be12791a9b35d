#!/bin/sh
# Installs what is missing, builds, and runs the main example: a strip load on a saturated foundation.
. "$(dirname "$0")/../tests/prepare.sh"
install_packages
build peat
cd "$PEAT_ROOT"
"$PEAT_BUILD/peat" run prm/examples/strip_foundation.prm --output output/strip_foundation
/usr/bin/python3 prm/plot.py output/strip_foundation
echo
echo "Open output/strip_foundation/solution.pvd in ParaView, or look at output/strip_foundation/overview.png."
