#!/bin/sh
# Lays out what an image needs to run the PROGRAMs and nothing else: LIBRARIES, a file system with the
# shared libraries they load and what Debian says of their packages, and TARGET, one with the programs.
#   collect_runtime.sh LIBRARIES TARGET PROGRAM...
set -eu
libraries=$1
target=$2
shift 2

if ldd "$@" | grep 'not found'; then
  echo "collect_runtime: a shared library is missing" >&2
  exit 1
fi
mkdir -p "$libraries/etc" "$libraries/var/lib/dpkg/status.d" "$target/usr/local/bin"

# Scanners read names and versions of the packages here; the licences ask that their text goes along.
describe_package() {
  [ ! -e "$libraries/var/lib/dpkg/status.d/$1" ] || return 0
  dpkg-query -s "$1" >"$libraries/var/lib/dpkg/status.d/$1"
  mkdir -p "$libraries/usr/share/doc/$1"
  cp -Lp "/usr/share/doc/$1/copyright" "$libraries/usr/share/doc/$1/copyright"
}

# Each under the name the loader asks for, links and alternatives followed. dpkg may know the file
# without its leading /usr.
for library in $(ldd "$@" | awk '$2 == "=>" {print $3} $1 ~ /^\/.*[^:]$/ {print $1}' | sort -u); do
  mkdir -p "$libraries$(dirname "$library")"
  cp -Lp "$library" "$libraries$library"
  file=$(readlink -f "$library")
  owner=$(dpkg-query -S "$file" 2>/dev/null || dpkg-query -S "${file#/usr}")
  describe_package "${owner%%:*}"
done
# Whom an S3 store's certificate may come from.
mkdir -p "$libraries/etc/ssl/certs"
cp -Lp /etc/ssl/certs/ca-certificates.crt "$libraries/etc/ssl/certs/"
describe_package ca-certificates
cp -Lp /etc/os-release "$libraries/etc/os-release"
echo 'rilievo:x:10001:10001:rilievod:/nonexistent:/usr/sbin/nologin' >"$libraries/etc/passwd"
echo 'rilievo:x:10001:' >"$libraries/etc/group"
# The same packages make the same layer, whenever it is made.
find "$libraries" -newer /etc/os-release -exec touch -h -r /etc/os-release {} +

# They must run with these files alone.
for program in "$@"; do
  name=$(basename "$program")
  strip --strip-unneeded -o "$target/usr/local/bin/$name" "$program"
  cp "$target/usr/local/bin/$name" "$libraries/$name"
  chroot "$libraries" "/$name" --version
  rm "$libraries/$name"
done
touch -r /etc/os-release "$libraries"
