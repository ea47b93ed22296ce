#!/usr/bin/env bash
# The image that docker/Dockerfile really makes, run shut in: read-only, non-root, no capabilities,
# 256 MB of memory and one CPU. Scans are sent from outside by BIN_DIR/rilievo.
#   tests/docker_test.sh BIN_DIR
set -euo pipefail
bin=$(realpath "$1")
cd "$(dirname "$0")/.."
source docker/engine.sh

IMAGE=localhost/rilievod:test
MAX_IMAGE_BYTES=400000000
DRAIN_SECONDS=40 # the server's own 30, and some
container=rilievod-test-$$
work=$(mktemp -d)
passed=0 failed=0

finish() {
  "${engine[@]}" rm -f -v "$container" >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap finish EXIT

# check NAME COMMAND...: one line, one count.
check() {
  local name=$1
  shift
  if "$@"; then
    passed=$((passed + 1)) && echo "ok      $name"
  else
    failed=$((failed + 1)) && echo "FAILED  $name"
  fi
}
no() { ! "$@"; }
quietly() { "$@" >/dev/null; }
# within VALUE LOW HIGH: decimal numbers.
within() { awk -v v="$1" -v low="$2" -v high="$3" 'BEGIN {exit !(v != "" && v >= low && v <= high)}'; }
# field FILE A.B: a member of a JSON object.
field() {
  python3 - "$@" <<'PYTHON'
import functools, json, sys
print(functools.reduce(lambda value, name: value[name], sys.argv[2].split("."), json.load(open(sys.argv[1]))))
PYTHON
}
image_says() { "${engine[@]}" image inspect --format "$1" $IMAGE; }
container_says() { "${engine[@]}" inspect --format "$1" "$container"; }

check_image() {
  local size files=$work/files
  size=$(image_says '{{.Size}}')
  "${engine[@]}" create --name "$container" "${bare_machine[@]}" $IMAGE >/dev/null
  "${engine[@]}" export "$container" | tar -t >"$files"
  "${engine[@]}" rm "$container" >/dev/null
  echo "image: $((size / 1000000)) MB, $(grep -c '\.so' "$files") shared libraries of" \
    "$(grep -c 'status\.d/.' "$files") packages"
  check "image below $((MAX_IMAGE_BYTES / 1000000)) MB" within "$size" 1 $MAX_IMAGE_BYTES
  check "user is a number and not root" grep -qxE '[1-9][0-9]*:[1-9][0-9]*' <<<"$(image_says '{{.Config.User}}')"
  check "two programs, rilievod and its worker" test \
    "$(grep -E '(^|/)s?bin/.' "$files" | sort | xargs)" = "usr/local/bin/rilievo-worker usr/local/bin/rilievod"
  check "no header, static library or build file" no grep -E '\.(h|hh|hpp|a|o|cmake|pc)$' "$files"
  check "a store, a volume of the user" test "$(image_says '{{json .Config.Volumes}}')" = \
    '{"/var/lib/rilievo":{}}'
  check "packages of the libraries are named" grep -q 'status\.d/libgrpc++' "$files"
  check "a bill of software" grep -q 'share/doc/rilievo/sbom\.spdx\.json$' "$files"
  check "labels say version and licence" grep -qE '^[0-9.]+ Apache-2\.0$' <<<"$(image_says \
    '{{index .Config.Labels "org.opencontainers.image.version"}} {{index .Config.Labels "org.opencontainers.image.licenses"}}')"
  check "without a word of who may call it does not start" no quietly timeout 20 \
    "${engine[@]}" run --rm "${bare_machine[@]}" $IMAGE 2>/dev/null
}

# The image's own health check, asked of the port that the server has here.
probe() {
  "${engine[@]}" exec "$container" "${health_check[@]}" 2>"$work/probe"
}
wait_healthy() {
  mapfile -t health_check < <(image_says '{{range .Config.Healthcheck.Test}}{{println .}}{{end}}' |
    sed "/^CMD$/d; /^$/d; s/:50051$/:$inner_port/")
  for _ in $(seq 100); do
    probe && return
    sleep 0.1
  done
  cat "$work/probe"
  "${engine[@]}" logs "$container"
  return 1
}

process_says() { awk -v name="$1:" '$1 == name {print $2}' "/proc/$pid/status"; }
cgroup_says() { cut -d' ' -f1 "$(cgroup_file "$pid" "$@")"; }

check_confinement() {
  pid=$(container_says '{{.State.Pid}}')
  if [ "$(cat "/proc/$pid/comm" 2>/dev/null)" != rilievod ]; then
    pid=""
    echo "the engine's processes cannot be seen from here: confinement not looked at"
    return
  fi
  check "process is not root" within "$(process_says Uid)" 1 4294967294
  check "no capabilities, none to be gained" \
    grep -qxE '0+' <<<"$(process_says CapEff)$(process_says CapPrm)$(process_says CapInh)$(process_says CapBnd)"
  check "no new privileges" test "$(process_says NoNewPrivs)" = 1
  check "system calls filtered" test "$(process_says Seccomp)" = 2
  check "root file system read-only" grep -qE '^[0-9]+ [0-9]+ [^ ]+ / / ro' "/proc/$pid/mountinfo"
  # shellcheck disable=SC2016  # awk's own $
  check "nothing else writable but the store" no awk '$6 !~ /^ro(,|$)/ && $5 !~ "^/(proc|dev|sys)(/|$)" &&
      $5 != "/var/lib/rilievo" {
    print
    found = 1
  } END {exit !found}' "/proc/$pid/mountinfo"
  if [[ " ${limits[*]} " == *" --memory="* ]]; then
    check "memory limit of 256 MB in force" \
      test "$(cgroup_says memory memory.limit_in_bytes memory.max)" = $((256 << 20))
  fi
  if [[ " ${limits[*]} " == *" --cpus="* ]]; then
    check "limit of one CPU in force" test "$(cgroup_says cpu cpu.cfs_quota_us cpu.max)" = 100000
  fi
}

# A torus, the result against the scan and against 200 000 points of the true torus. Distances in %
# of the diagonal; a point of the scan is off by 0.05 (1 sigma).
reconstruct_torus() {
  local scan=$work/scan.ply surface=$work/torus.dss
  "$bin/rilievo" simulate torus -o "$scan" --points 20000 --noise 0.0005 --seed 1 >/dev/null
  "$bin/rilievo" simulate torus -o "$work/true.ply" --points 200000 --views 0 --seed 2 >/dev/null
  check "reconstruction from outside" quietly timeout 120 \
    "$bin/rilievo" reconstruct "$scan" -o "$surface" --server "127.0.0.1:$port" --quiet
  [ -s "$surface" ] || return 0
  "$bin/rilievo" info "$surface" --json >"$work/info"
  "$bin/rilievo" compare "$surface" "$scan" --json >"$work/to_scan"
  "$bin/rilievo" compare "$surface" "$work/true.ply" --json >"$work/to_true"
  local of_scan of_torus of_surface
  of_scan=$(field "$work/to_scan" b_to_a.rms_percent)
  of_torus=$(field "$work/to_true" b_to_a.rms_percent)
  of_surface=$(field "$work/to_true" a_to_b.rms_percent)
  printf 'RMS: scan to surface %.4f %%, torus to surface %.4f %%, surface to points of torus %.4f %%\n' \
    "$of_scan" "$of_torus" "$of_surface"
  check "manifold, closed, genus 1" test "$(for name in manifold closed genus; do
    field "$work/info" $name
  done | xargs)" = "True True 1"
  check "scan to surface: RMS within the noise" within "$of_scan" 0.000001 0.05
  check "torus to surface: RMS within the noise" within "$of_torus" 0.000001 0.05
  # Half the 0.25 % that 200 000 points lie apart, and the noise.
  check "surface to torus: RMS within the gaps" within "$of_surface" 0.000001 0.175
}

# A kept job: two clients of one request, the same bytes as in one call, also from the next server on
# the same volume.
keep_job() {
  local server="127.0.0.1:$port" job
  check "a job is kept and worked on" quietly timeout 120 \
    "$bin/rilievo" jobs submit "$work/scan.ply" --server "$server" --request-id torus --wait --quiet
  "$bin/rilievo" jobs submit "$work/scan.ply" --server "$server" --request-id torus --json >"$work/job"
  job=$(field "$work/job" job_id)
  check "asked again it is the same one" test \
    "$("$bin/rilievo" jobs list --server "$server" --json | grep -c "$job")" = 1
  check "watched to its end" quietly timeout 60 \
    "$bin/rilievo" jobs watch "$job" --server "$server" --quiet
  "${engine[@]}" kill --signal KILL "$container" >/dev/null
  "${engine[@]}" wait "$container" >/dev/null || true
  "${engine[@]}" start "$container" >/dev/null
  check "healthy after SIGKILL and a start" wait_healthy
  check "fetched from the server after it" quietly timeout 60 \
    "$bin/rilievo" jobs fetch "$job" --server "$server" -o "$work/kept.dss"
  check "the same bytes as in one call" cmp "$work/kept.dss" "$work/torus.dss"
  [ -z "$pid" ] || pid=$(container_says '{{.State.Pid}}')
}

# SIGTERM while a job is worked on: the job ends well, then the server, by itself.
drain() {
  local client client_status=0 peak_file="" peak="" status
  [ -z "$pid" ] || peak_file=$(cgroup_file "$pid" memory memory.max_usage_in_bytes memory.peak)
  "$bin/rilievo" simulate genus2 -o "$work/late.ply" --points 60000 --noise 0.0005 --seed 1 >/dev/null
  timeout 120 "$bin/rilievo" reconstruct "$work/late.ply" -o "$work/late.dss" \
    --server "127.0.0.1:$port" >/dev/null 2>"$work/late.log" &
  client=$!
  for _ in $(seq 200); do
    grep -q '^\[1/' "$work/late.log" && break
    sleep 0.02
  done
  "${engine[@]}" kill --signal TERM "$container" >/dev/null
  while kill -0 $client 2>/dev/null; do
    peak=$(cat "$peak_file" 2>/dev/null || echo "$peak")
    sleep 0.05
  done
  wait $client || client_status=$?
  status=$(timeout $DRAIN_SECONDS "${engine[@]}" wait "$container" || true)
  "${engine[@]}" logs "$container" >"$work/server.log" 2>&1
  sed 's/^/  | /' "$work/server.log"
  [ -z "$peak" ] || echo "memory in use: at most $((peak / 1000000)) MB"
  check "the running job ends well" test "$client_status" = 0
  check "exit code 0" test "$status" = 0
  check "told to drain during the job, ended after it" test "$(
    sed -n '/draining/,$p' "$work/server.log" | grep -oE 'draining|\bOK\b|ended' | xargs
  )" = "draining OK ended"
}

if [ "${engine[0]}" != docker ] && [ "$(id -u)" -ne 0 ]; then
  echo "docker_test: without a Docker engine this needs root" >&2
  exit 1
fi
mkdir -p build
log=build/docker-build.log
echo "building the image with ${engine[0]}; what it says is in $log"
start=$SECONDS
build_image $IMAGE "$work" >"$log" 2>&1 || {
  tail -60 "$log"
  echo "the image could not be built" >&2
  exit 1
}
echo "built in $((SECONDS - start)) s"
check_image
find_limits $IMAGE
start_container "$container" $IMAGE >/dev/null
check "healthy, by the image's own check" wait_healthy
check "the check fails where nothing serves" test "$(
  "${engine[@]}" exec "$container" /usr/local/bin/rilievod --probe 127.0.0.1:1 2>/dev/null || echo $?
)" = 1
check_confinement
reconstruct_torus
keep_job
drain
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
