#!/bin/sh
# Compiles the yardstick to target/embree-yardstick, if Embree is installed.
cd "$(dirname "$0")/../.." && mkdir -p target || exit 1
for major in 4 3; do
    [ -e /usr/include/embree$major/rtcore.h ] || [ -e /usr/local/include/embree$major/rtcore.h ] || continue
    if ${CXX:-g++} -O3 -march=native -std=c++17 -o target/embree-yardstick bench/embree/yardstick.cpp -lembree$major; then
        exit 0
    fi
done
rm -f target/embree-yardstick
echo "no yardstick: Embree or a C++ compiler is missing (Debian: apt-get install g++ libembree-dev)" >&2
