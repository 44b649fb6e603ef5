#!/bin/bash
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
#
# The first process of a kernel that the bus provider boots: makes the CAN interfaces and hands
# over to the agent. The kernel passes the HIL_ variables from its command line.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
here=$(dirname "${BASH_SOURCE[0]}")

# start_agent [REASON]: with a reason it only tells the provider why there is no bus
start_agent() {
  # -S, -E: the user's Python packages and settings are for the command, not for the agent.
  exec /usr/bin/python3 -B -E -S "$here/agent.py" "$HIL_CHANNEL" "$@"
}

# must COMMAND...: its message is the reason if it fails
must() {
  local message
  message=$("$@" 2>&1) || start_agent "'$*' failed inside: $message"
}

# The root is the host's: its /dev, /proc and /sys would speak of another kernel.
mount_own() {
  mount -t proc proc /proc
  mount -t sysfs sysfs /sys
  mountpoint -q /dev || mount -t devtmpfs devtmpfs /dev
  mkdir -p /dev/pts /dev/shm /dev/understory
  mount -t devpts -o mode=620,ptmxmode=666 devpts /dev/pts
  ln -sf pts/ptmx /dev/ptmx
  mount -t tmpfs -o mode=1777 tmpfs /dev/shm
  ln -sfn /proc/self/fd /dev/fd
  local name
  for name in 0/stdin 1/stdout 2/stderr; do ln -sf "/proc/self/fd/${name%/*}" "/dev/${name#*/}"; done
}

# Modules load when they are needed, as on any machine, but from the provider's folder: the host
# may have no /lib/modules at all.
find_modules() {
  mkdir -p /dev/understory/lib/modules
  ln -s "$HIL_MODULES/$(uname -r)" "/dev/understory/lib/modules/$(uname -r)"
  printf '#!/bin/sh\nexec modprobe -C /dev/null -d /dev/understory "$@"\n' >/dev/understory/modprobe
  chmod +x /dev/understory/modprobe
  echo /dev/understory/modprobe >/proc/sys/kernel/modprobe
}

make_buses() {
  must /dev/understory/modprobe -a can can-raw can-bcm can-gw can-dev slcan
  must /dev/understory/modprobe vcan "echo=$HIL_ECHO"
  must ip link set lo up
  local number name
  for ((number = 0; number < HIL_INTERFACES; number++)); do
    name=vcan$number
    must ip link add dev "$name" type vcan
    must ip link set "$name" up
    if [[ -n $HIL_BITRATE ]]; then
      must tc qdisc add dev "$name" root netem rate "${HIL_BITRATE}bit" limit "$HIL_QUEUE"
    fi
  done
}

mount_own
# The one name that every machine resolves; ROS announces itself with it.
hostname localhost
find_modules
make_buses
start_agent
