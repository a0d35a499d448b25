# The library compiled for Windows by clang and mingw-w64's headers, and the tests of it that need no POSIX, under Wine.  One instruction set, not
# optimised: what is tested is that it compiles, links and computes there.  Half of the first run compiles the C++ library for Windows.
.PHONY: test-windows

windows := CC=$(CURDIR)/scripts/dist/zig/cc CXX=$(CURDIR)/scripts/dist/zig/c++ ZIG_TARGET=x86_64-windows-gnu CCACHE_NAMESPACE=x86_64-windows \
  ZIG=$$(build/dist-tools/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).with_name("zig"))') \
  WINEPREFIX=$(CURDIR)/build/windows/wine WINEDEBUG=-all WINEPATH=$(CURDIR)/build/windows

test-windows: build/dist-tools/.installed
	scripts/system_packages.sh windows
	mkdir -p build/windows-include
	ln -sfn "$$(dirname "$$(find /usr/include /usr/local/include -name doctest.h -print -quit)")" build/windows-include/doctest
	$(windows) cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/build/dist-tools/bin/ninja -S . -B build/windows -DCMAKE_SYSTEM_NAME=Windows \
	  -DCMAKE_SYSTEM_PROCESSOR=x86_64 -DCMAKE_CROSSCOMPILING_EMULATOR=wine -DKSL_TESTS=ON -DKSL_FETCH_PUGIXML=ON \
	  -DKSL_INSTRUCTION_SETS=x86_64_v2 -DKSL_PLAIN_SETS=x86_64_v2 -DDOCTEST_INCLUDE=$(CURDIR)/build/windows-include >/dev/null
	$(windows) cmake --build build/windows -- --quiet
	$(windows) ctest --test-dir build/windows --output-on-failure
