# make run [SCENE=file.glb]   set up, build, render and judge the scenes: pictures under out/, a table on the terminal
# make test                   set up, build, run every test
# make setup | build | bench | cost | lint | clean

SCENE ?=
JOBS ?= $(shell nproc)
GNOMON_EXTRA_DATA ?=

.PHONY: run setup configure build test bench cost lint clean

run: build
	build/gnomon run $(if $(SCENE),"$(SCENE)") --out out

setup:
	@.ci/setup

configure: setup
	@cmake --preset release -DGNOMON_EXTRA_DATA="$(GNOMON_EXTRA_DATA)" >build-configure.log 2>&1 \
	  || { cat build-configure.log >&2; exit 1; }

build: configure
	cmake --build build -j $(JOBS)

test: build
	ctest --test-dir build --output-on-failure -j $(JOBS)

bench: build
	build/gnomon_bench

cost: build
	build/gnomon_cost

lint: configure
	clang-format --dry-run -Werror $(wildcard include/gnomon/*.h solver/*.h solver/*.cpp tests/*.cpp tests/*.h tests/bench/*.cpp tests/cost/*.cpp samples/*/*.h samples/*/*.cpp)
	clang-tidy -p build --quiet --warnings-as-errors='*' --extra-arg=-Wno-unknown-warning-option $(wildcard solver/*.cpp)

clean:
	rm -rf build build-asan build-configure.log out
