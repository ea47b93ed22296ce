#!/usr/bin/env bash
# Programs are hardened as Debian hardens its own (dpkg-buildflags), and this test would notice if not.
#   hardening.sh CXX PROGRAM...
set -euo pipefail
cxx=$1
shift

# Prints what a program lacks.
lacks() { # PROGRAM
  local dynamic segments symbols
  dynamic=$(readelf -dW "$1") segments=$(readelf -lW "$1") symbols=$(readelf --dyn-syms -W "$1")
  grep -q 'Type:.*DYN' <<<"$(readelf -hW "$1")" || echo "a place of its own in memory (PIE)"
  grep -q 'GNU_RELRO' <<<"$segments" || echo "read-only relocations (RELRO)"
  grep -qE 'BIND_NOW|FLAGS_1.*NOW' <<<"$dynamic" || echo "all symbols bound at the start (BIND_NOW)"
  grep -qE 'GNU_STACK.* RW ' <<<"$segments" || echo "a stack that is not executable"
  grep -q '__stack_chk_fail' <<<"$symbols" || echo "stack protection"
  grep -qE ' __(mem|str|s?n?printf|v?f?printf|read|pread)[a-z]*_chk' <<<"$symbols" || echo "checked calls (FORTIFY_SOURCE)"
}

failed=0
for program in "$@"; do
  missing=$(lacks "$program")
  [ -z "$missing" ] && echo "ok      $(basename "$program")" && continue
  echo "FAILED  $(basename "$program") lacks:"
  sed 's/^/  /' <<<"$missing"
  failed=1
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
echo 'int main() {}' >"$work/bare.cc"
"$cxx" -no-pie -fno-stack-protector -Wl,-z,norelro,-z,lazy,-z,execstack "$work/bare.cc" -o "$work/bare"
if [ "$(lacks "$work/bare" | wc -l)" -eq 6 ]; then
  echo "ok      a program without any of it is found"
else
  echo "FAILED  of a program without any of it this is said to be missing only: $(lacks "$work/bare" | xargs -d '\n')"
  failed=1
fi
exit $failed
