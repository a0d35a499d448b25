#!/bin/sh
# Builds libksl0 and libksl-dev from the commit that is checked out, into build/debian.  Needs what packaging/debian/control names, and devscripts.
#   KSL_SETS, KSL_PLAIN_SETS: as the options of CMake, to try it in less time
set -eu
cd "$(dirname "$0")/../.."
version=$(sed -n 's/#define KSL_VERSION "\(.*\)"/\1/p' include/ksl/config.h)
place=build/debian/ksl-$version
rm -rf build/debian && mkdir -p "$place"
git archive HEAD | tar -x -C "$place"
git archive --prefix="ksl-$version/" -o "build/debian/ksl_$version.orig.tar.gz" HEAD
cp -r packaging/debian "$place/debian"
rm "$place/debian/build.sh"
sed "s/^\$/./; s/^/ /" LICENSE >>"$place/debian/copyright"
printf 'ksl (%s-1) unstable; urgency=medium\n\n  * Version %s.\n\n -- The KSL founders <ksl@localhost>  %s\n' \
  "$version" "$version" "$(git log -1 --format=%cD)" >"$place/debian/changelog"
cd "$place"
dpkg-buildpackage --no-sign --build=binary
ls -l ../*.deb
