# The library and the tests in C and C++, compiled and linked for macOS on both its processors, by zig's clang with its stubs of macOS.  No test runs: there is no Mac
# here.  One instruction set, not optimised.  ccache, where it is set, knows nothing of ZIG_TARGET: each target has a name space of it.
.PHONY: compile-macos
compile-macos: build/macos-aarch64/.compiled build/macos-x86_64/.compiled

macos = CC=$(CURDIR)/scripts/dist/zig/cc CXX=$(CURDIR)/scripts/dist/zig/c++ ZIG_TARGET=$*-macos.13.0 CCACHE_NAMESPACE=$*-macos \
  ZIG=$$(build/dist-tools/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).with_name("zig"))')

# CMake asks for install_name_tool, which renames what is installed: nothing is
build/macos-%/.compiled: build/dist-tools/.installed $(SOURCES)
	scripts/system_packages.sh test
	mkdir -p build/macos-include
	ln -sfn "$$(dirname "$$(find /usr/include /usr/local/include -name doctest.h -print -quit)")" build/macos-include/doctest
	$(macos) cmake -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/build/dist-tools/bin/ninja -S . -B build/macos-$* -DCMAKE_SYSTEM_NAME=Darwin \
	  -DCMAKE_SYSTEM_PROCESSOR=$* -DCMAKE_INSTALL_NAME_TOOL=/usr/bin/false -DCMAKE_RANLIB=$(CURDIR)/scripts/dist/zig/ranlib -DCMAKE_CXX_FLAGS=-Wno-c2y-extensions -DKSL_TESTS=ON -DKSL_FETCH_PUGIXML=ON \
	  -DKSL_INSTRUCTION_SETS=x86_64_v2 -DKSL_PLAIN_SETS="x86_64_v2;neon" -DDOCTEST_INCLUDE=$(CURDIR)/build/macos-include >/dev/null
	$(macos) cmake --build build/macos-$* -- --quiet -k 0
	touch $@
