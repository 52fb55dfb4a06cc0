set -e
tools/setup --demo >/tmp/setup.log 2>&1 || { tail -5 /tmp/setup.log; exit 1; }
cmake --preset release -DBUSHD_TESTS=OFF -DBUSHD_BENCHMARKS=OFF >/tmp/cmake.log 2>&1 || { tail -5 /tmp/cmake.log; exit 1; }
cmake --build --preset release --target bushd bushsim bushctl bushd-web >/tmp/build.log 2>&1 || { grep -A12 error /tmp/build.log | head -60; exit 1; }
dpkg-query -W libwebsockets-dev
cd build/release
for f in page_test access_test hostile_test; do
env BUSHD_WEB=$PWD/bin/bushd-web BUSHD=$PWD/bin/bushd BUSHSIM=$PWD/bin/bushsim BUSHCTL=$PWD/bin/bushctl BUSHTAB=/bin/false timeout 200 ../../tests/tools/with-loopback-multicast python3 -B ../../tests/web/$f.py 2>&1 | tail -40
done
