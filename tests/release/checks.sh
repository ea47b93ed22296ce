# One line and one count for each check; sourced.
# shellcheck shell=bash
passed=0 failed=0

check() { # NAME COMMAND...
  local name=$1
  shift
  if "$@"; then
    passed=$((passed + 1)) && echo "ok      $name"
  else
    failed=$((failed + 1)) && echo "FAILED  $name"
  fi
}
# What it says is shown where it fails.
quietly() {
  local said
  said=$("$@" 2>&1) || { tail -20 <<<"$said" | sed 's/^/  | /'; return 1; }
}
