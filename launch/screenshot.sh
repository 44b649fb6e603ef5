#!/bin/bash
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Flies a mission and takes a picture of it in RViz, without a display (Xvfb, software GL).
# usage: launch/screenshot.sh FILE.png [SECONDS_INTO_THE_FLIGHT [FLY_OPTION...]]
set -euo pipefail
export PATH=/usr/sbin:/usr/bin:/sbin:/bin

root=$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")
readonly root
readonly picture=${1:-}
readonly after_s=${2:-60}
[[ $picture == *.png && $after_s =~ ^[0-9]+$ ]] || {
  echo "usage: launch/screenshot.sh FILE.png [SECONDS [FLY_OPTION...]]" >&2
  exit 2
}
shift $(($# < 2 ? $# : 2))

work=$(mktemp -d)
children=()
finish() {
  local i
  for ((i = ${#children[@]} - 1; i >= 0; --i)); do  # who is looked at goes last
    kill -INT "${children[i]}" 2>/dev/null || true
    wait "${children[i]}" 2>/dev/null || true
  done
  rm -rf "$work"
}
trap finish EXIT

"$root/understory" fly --quiet --no-report --out "$work/result" "$@" >"$work/fly.log" 2>&1 &
children+=($!)
until uri=$(sed -n 's/^export ROS_MASTER_URI=//p' "$work/fly.log") && [[ -n $uri ]]; do
  kill -0 "${children[0]}" 2>/dev/null || { cat "$work/fly.log" >&2; exit 1; }
  sleep 0.5
done

Xvfb -displayfd 3 -screen 0 1280x800x24 -nolisten tcp 3>"$work/display" 2>/dev/null &
children+=($!)
until [[ -s $work/display ]]; do sleep 0.2; done
display=:$(<"$work/display")
DISPLAY=$display LIBGL_ALWAYS_SOFTWARE=1 ROS_MASTER_URI=$uri HOME=$work \
  rviz --fullscreen -d "$root/launch/mission.rviz" >"$work/rviz.log" 2>&1 &
children+=($!)

sleep "$after_s"
import -display "$display" -window root "$picture"
echo "$picture"
