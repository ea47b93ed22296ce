# Builds and runs the image with whatever this machine has; sourced by tests/docker_test.sh.
# With a Docker engine, docker. Without one, and as root: mmdebstrap makes the base image, buildah
# builds in a chroot, podman and runc run. Sets `engine`, the command that takes docker's words.
# shellcheck shell=bash

BASE=localhost/rilievo-debian:bookworm

if docker info >/dev/null 2>&1; then
  engine=(docker)
else
  engine=(podman --runtime runc --cgroup-manager cgroupfs)
fi
# What a bare machine asks of podman: no bridge, no systemd timers, limits of its own to keep.
bare_machine=()
[ "${engine[0]}" = docker ] || bare_machine=(--network host --no-healthcheck
  --ulimit nofile=4096:4096 --ulimit nproc=4096:4096)

# Debian's minimal system without what Debian's slim image leaves out.
make_base() { # WORK_DIR
  podman image exists $BASE && return
  mmdebstrap --quiet --variant=minbase \
    --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
    bookworm "$1/base.tar"
  podman import --quiet "$1/base.tar" $BASE
  rm "$1/base.tar"
}

build_image() { # IMAGE WORK_DIR
  local arguments=(-f docker/Dockerfile -t "$1" --build-arg "JOBS=${JOBS:-$(nproc)}"
    --build-arg "VERSION=$(sed -n 's/^project(.* VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)"
    --build-arg "REVISION=$(git rev-parse HEAD 2>/dev/null)")
  if [ "${engine[0]}" = docker ]; then
    docker build "${arguments[@]}" .
  else
    make_base "$2" &&
      buildah bud --isolation chroot --network host --pull-never --format docker --layers \
        --storage-driver overlay --build-arg DEBIAN_IMAGE=$BASE "${arguments[@]}" .
  fi
}

# Sets `limits` to those this machine can enforce, each tried alone, and says which it cannot.
find_limits() { # IMAGE
  local limit said
  limits=()
  for limit in "--memory=256m --memory-swap=256m" --cpus=1 --pids-limit=256; do
    # shellcheck disable=SC2086  # one or two words
    if said=$("${engine[@]}" run --rm $limit "${bare_machine[@]}" "$1" --version 2>&1); then
      # shellcheck disable=SC2206
      limits+=($limit)
    else
      echo "LIMIT NOT APPLIED, this machine refuses $limit: $(tail -1 <<<"$said")"
    fi
  done
}

# Sets `port`, where the server is reached from outside, and `inner_port`, where it listens.
start_container() { # NAME IMAGE
  local flags=(--detach --name "$1" --read-only --cap-drop ALL --security-opt no-new-privileges
    "${limits[@]}" "${bare_machine[@]}")
  port=$(python3 -c '
import socket
with socket.socket() as s:
    try: s.bind(("127.0.0.1", 50051))
    except OSError: s.bind(("127.0.0.1", 0))
    print(s.getsockname()[1])')
  if [ "${engine[0]}" = docker ]; then
    inner_port=50051
    docker run "${flags[@]}" -p "127.0.0.1:$port:$inner_port" "$2" \
      --listen "0.0.0.0:$inner_port" --allow-plaintext --store /var/lib/rilievo
  else
    inner_port=$port
    "${engine[@]}" run "${flags[@]}" --read-only-tmpfs=false "$2" \
      --listen "127.0.0.1:$port" --store /var/lib/rilievo
  fi
}

# cgroup_file PID CONTROLLER NAME_V1 NAME_V2: a file of the process's control group, of whichever
# version the machine has.
cgroup_file() {
  local path
  path=$(awk -F: -v c="$2" 'index("," $2 ",", "," c ",") {print $3}' "/proc/$1/cgroup")
  if [ -n "$path" ]; then
    echo "/sys/fs/cgroup/$2$path/$3"
  else
    echo "/sys/fs/cgroup$(awk -F: '$1 == 0 {print $3}' "/proc/$1/cgroup")/$4"
  fi
}
