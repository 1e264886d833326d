#!/bin/sh
# install.sh FOLDER: the npm packages of package-lock.json into FOLDER/node_modules, if they are not there yet. `./dev` runs it when it sets
# a machine up, and the suite before the tests that need them, so that what is missing is a failure and never a test left out.
set -eu
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
mkdir -p "$1"
cd "$1"
if [ -f node_modules/.installed ] && cmp -s "$here/package-lock.json" node_modules/.installed; then
    exit 0
fi
command -v npm >/dev/null 2>&1 || {
    echo 'npm is missing: install the Debian packages nodejs and npm (./dev test does)' >&2
    exit 1
}
cp "$here/package.json" "$here/package-lock.json" .
npm ci --prefer-offline --no-audit --no-fund --loglevel=error
cp package-lock.json node_modules/.installed
