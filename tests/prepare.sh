# Sourced by the two set-up scripts: installs what is missing on Debian 12 or Ubuntu, and builds.
set -eu

PEAT_ROOT=$(cd "$(dirname "$0")/.." && pwd)
PEAT_BUILD=${PEAT_BUILD:-$PEAT_ROOT/build}
JOBS=${JOBS:-$(nproc)}

# OpenMPI refuses to run as root unless told that this is meant, and more ranks than cores likewise.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1

PEAT_PACKAGES="g++ make cmake git libdeal.ii-dev libboost-program-options-dev libboost-test-dev libeigen3-dev
  libmuparser-dev nlohmann-json3-dev zlib1g-dev openmpi-bin python3 python3-numpy python3-matplotlib"

install_packages() {
  missing=""
  for package in $PEAT_PACKAGES; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "install ok installed" || missing="$missing $package"
  done
  [ -z "$missing" ] && return
  echo "installing:$missing"
  as_root=""
  [ "$(id -u)" -eq 0 ] || as_root="sudo"
  $as_root apt-get update -qq
  DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq --no-install-recommends $missing > /dev/null
}

# build TARGET...
build() {
  cmake -S "$PEAT_ROOT" -B "$PEAT_BUILD" -DCMAKE_BUILD_TYPE=Release > "$PEAT_BUILD.log" 2>&1 ||
    { cat "$PEAT_BUILD.log"; exit 1; }
  cmake --build "$PEAT_BUILD" -j "$JOBS" --target "$@"
}
