#!/bin/sh
# SPDX-License-Identifier: MIT
# tests/golden/make.sh RILL: makes the golden asset of the current format version from frames of content/, and writes
# down what it is and decodes to, which test_versions holds it to. Once per version: an asset of a released version is
# never made again; it must load for ever, or be refused by its number.
set -eu
[ $# -eq 1 ] || { echo "usage: tests/golden/make.sh RILL" >&2; exit 1; }
rill=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
cd "$(dirname "$0")"
input=../../content/drop_splash
"$rill" cook $input -o v8.rill --frames 20:28 --window 8 --layers 3 --error 0.5e --jobs 1 --force --quiet || [ $? -eq 3 ]
"$rill" info v8.rill --json >v8.info.json
"$rill" verify v8.rill $input --frames 24 --json v8.verify.json >/dev/null 2>&1 || [ $? -eq 3 ]  # 3: an error target missed
ls -l v8.*
