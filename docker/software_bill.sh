#!/bin/sh
# Prints what the image is made of as SPDX 2.3 JSON: the program, and the packages of Debian whose
# libraries it loads, as collect_runtime.sh has laid them out under LIBRARIES.
#   software_bill.sh LIBRARIES "NAME VERSION"
set -eu
status=$1/var/lib/dpkg/status.d
name=${2% *}
version=${2#* }

package() { # ID NAME VERSION LICENSE LOCATOR
  cat <<JSON
    {"SPDXID": "SPDXRef-$1", "name": "$2", "versionInfo": "$3", "licenseDeclared": "$4",
     "licenseConcluded": "NOASSERTION", "copyrightText": "NOASSERTION", "downloadLocation": "NOASSERTION",
     "filesAnalyzed": false, "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER",
     "referenceType": "purl", "referenceLocator": "$5"}]}
JSON
}
field() { sed -n "s/^$1: //p" "$2"; }
# Letters, digits, '.' and '-' are all that an identifier may have.
identifier() { printf %s "$1" | sed 's/[^A-Za-z0-9.-]/-/g'; }

# The same files make the same bill: named by their sum, of the time of the base system.
sum=$(cat "$status"/* | sha256sum | cut -d' ' -f1)
cat <<JSON
{
  "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
  "name": "$name-$version", "documentNamespace": "https://rilievo.dev/spdx/$name-$version-$sum",
  "creationInfo": {"created": "$(date -u -r "$1/etc/os-release" +%Y-%m-%dT%H:%M:%SZ)",
                   "creators": ["Tool: rilievo-software-bill"]},
  "packages": [
JSON
package program "$name" "$version" Apache-2.0 "pkg:generic/$name@$version"
relations='    {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-program"}'
for file in "$status"/*; do
  library=$(field Package "$file")
  of_library=$(field Version "$file")
  architecture=$(field Architecture "$file")
  id=$(identifier "$library")
  echo "    ,"
  # A plus sign of a version is to be escaped in a locator.
  package "$id" "$library" "$of_library" NOASSERTION \
    "pkg:deb/debian/$(printf %s "$library" | sed 's/+/%2B/g')@$(printf %s "$of_library" | sed 's/+/%2B/g; s/:/%3A/g; s/~/%7E/g')?arch=$architecture"
  relations="$relations,
    {\"spdxElementId\": \"SPDXRef-program\", \"relationshipType\": \"DEPENDS_ON\", \"relatedSpdxElement\": \"SPDXRef-$id\"}"
done
cat <<JSON
  ],
  "relationships": [
$relations
  ]
}
JSON
