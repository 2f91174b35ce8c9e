#!/usr/bin/env bash
# Installs the Debian packages of packages.txt that are missing, with sudo when not root.
# When all are there it does nothing and touches no network.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

mapfile -t packages < <(sed -e 's/#.*//' -e '/^[[:space:]]*$/d' "$here/packages.txt")

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "setup: this system has no apt-get. Please install, under the names they have here:" >&2
  printf 'setup:   %s\n' "${packages[@]}" >&2
  exit 0  # CMake says which of them it does not find
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed* ]] || missing+=("$package")
done
((${#missing[@]})) || exit 0

# Those of the missing packages that this release has.
offered() {
  local package
  for package in "${missing[@]}"; do
    [[ $(LC_ALL=C apt-cache policy "$package") != *"Candidate: "[0-9]* ]] || echo "$package"
  done
}
# Nothing to install where the release's package lists are there and have none of them. All releases have g++; a list
# of another archive alone does not.
if [[ -z $(offered) && -n $(apt-cache madison g++ 2>/dev/null) ]]; then
  echo "setup: this release has no package ${missing[*]}; going on without"
  exit 0
fi

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "setup: packages are missing and there is no sudo. As root, run:" >&2
    mapfile -t wanted < <(offered)
    ((${#wanted[@]})) || wanted=("${missing[@]}")
    echo "setup:   apt-get update && apt-get install ${wanted[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q)
"${apt[@]}" update || echo "setup: the package lists could not be renewed; trying the old ones" >&2
mapfile -t wanted < <(offered)
echo "setup: installing ${wanted[*]}"
"${apt[@]}" install -y --no-install-recommends "${wanted[@]}"
