# make run [SCENE=file.glb]   set up, build, render and judge the scenes: pictures under out/, a table on the terminal
# make test                   set up, build, run every test
# make figures                the figures of [Lloyd 2006] from this solver's matrices: tables and drawings under out/figures/
# make report [QUICK=1]       speed against error of every method on the same views: out/report/report.html, .json, .csv
# make peers                  three.js, Babylon.js, OGRE and OpenSceneGraph on the same views, judged alike (a set-up of its own); the next report shows them
# make asan                   every test again, under the address and undefined-behaviour sanitizers
# make fuzz [TIME=60]         the fuzz targets, TIME seconds each: solve, case, glb, check (FUZZ="solve case" for some)
# make soak [CASES=1000000]   random and adversarial cases of every method
# make tsan                   hard cases solved by several threads at once, under the thread sanitizer
# make coverage               the share of the solver's lines that its tests run
# make faults                 seeded faults, one at a time: does the suite catch each?
# make docs                   headers and shaders as HTML: build/docs/html/index.html
# make setup | build | bench | cost | lint | clean

SCENE ?=
JOBS ?= $(shell nproc)
TIME ?= 60
FUZZ ?= solve case glb check
CASES ?= 1000000
GNOMON_EXTRA_DATA ?=

.PHONY: run setup configure build test report peers figures setup-docs asan tsan coverage fuzz soak faults bench cost docs lint clean

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

SPONZA = $(GNOMON_EXTRA_DATA)/scenes/sponza/sponza.glb
figures: build
	build/gnomon_figures out/figures $(wildcard $(SPONZA))
	gnuplot -e "folder='out/figures'" samples/figures/plot.gp

BUILT_IN = colonnade,relief,city,hall
empty :=
comma := ,
report: build
	build/gnomon report $(if $(QUICK),--quick) --out out/report \
	  $(if $(GNOMON_EXTRA_DATA),--scenes $(subst $(empty) ,$(comma),$(BUILT_IN) $(wildcard $(GNOMON_EXTRA_DATA)/scenes/*/*.glb)))

peers: build
	@.ci/setup peers
	npm install --silent --no-fund --prefix build/peers three@0.187 @babylonjs/core@9.35
	cp samples/peers/*.mjs build/peers/
	$(CXX) -std=c++17 -O2 samples/peers/ogre.cpp $$(pkg-config --cflags --libs OGRE) -o build/peers/ogre
	$(CXX) -std=c++20 -O2 samples/peers/osg.cpp $$(pkg-config --cflags --libs openscenegraph-osgShadow) -o build/peers/osg
	build/gnomon_peers cases build/peers/cases
	cd build/peers && node three.mjs cases/*.json >three.jsonl && node babylon.mjs cases/*.json >babylon.jsonl && ./ogre cases/*.json >ogre.jsonl && ./osg cases/*.json >osg.jsonl
	cd build/peers && ../gnomon_peers judge ../../out/report cases/*.json -- three.jsonl babylon.jsonl ogre.jsonl osg.jsonl

asan: setup
	cmake --preset asan -DGNOMON_EXTRA_DATA="$(GNOMON_EXTRA_DATA)"
	cmake --build build-asan -j $(JOBS)
	ctest --test-dir build-asan --output-on-failure -j $(JOBS)

tsan: setup
	cmake --preset tsan >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
	cmake --build build-tsan -j $(JOBS) --target gnomon_answers
	build-tsan/tests/gnomon_answers 200 4

# Of the tests that neither draw pictures nor start programs, line by line without optimisation.
coverage: setup
	cmake --preset coverage >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
	cmake --build build-coverage -j $(JOBS) --target gnomon_tests
	find build-coverage -name '*.gcda' -delete
	GNOMON_SOAK=1000 build-coverage/tests/gnomon_tests --gtest_brief=1 \
	  --gtest_filter='-Parity*:*/Parity*:Predicted*:Figures*:Job*:Scene*:Truth*:Check*:Readme*:Glsl*:Picture*:Wrong*:Cases*:Report*:Cli*:*BuiltIn*'
	cd build-coverage/CMakeFiles/gnomon.dir/solver && for each in *.gcno; do gcov -n -r -s $(CURDIR) $$each; done 2>/dev/null | \
	  awk -F"[':% ]+" '/^File/ {file = $$2} /^Lines/ {if (file ~ /solver.*[.]cpp$$/) {printf "%-24s %6.2f %% of %d\n", file, $$3, $$5; hit += $$3 * $$5; all += $$5} file = ""} END {printf "%.2f %% of %d lines\n", hit / all, all}'

# Every target in turn, from the corpus; what is found lies beside it as crash-*.
fuzz: setup
	cmake --preset fuzz >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
	cmake --build build-fuzz -j $(JOBS) --target $(addprefix fuzz_,$(FUZZ))
	@set -e; for target in $(FUZZ); do mkdir -p build-fuzz/corpus/$$target; echo "fuzz_$$target: $(TIME) s"; \
	  ASAN_OPTIONS=detect_leaks=0 build-fuzz/tests/fuzz_$$target -max_total_time=$(TIME) -print_final_stats=1 -verbosity=0 -artifact_prefix=build-fuzz/corpus/ \
	    build-fuzz/corpus/$$target tests/fuzz/corpus/$$target; done

# A million cases of every method that solves, or CASES.
soak: build
	GNOMON_SOAK=$(CASES) build/tests/gnomon_tests --gtest_filter='Hard.*'

# One seeded fault at a time in solver/ and glsl/, most of them half a minute each after the first build: all must be caught.
faults: setup
	python3 tests/faults/seed.py . build-faults

bench: build
	build/gnomon_bench

cost: build
	build/gnomon_cost

docs: setup-docs configure
	cmake --build build -j $(JOBS) --target libgnomon.a
	rm -rf build/docs
	doxygen build/solver/package/Doxyfile
	nm -C -g build/libgnomon.a | awk -f solver/package/documented.awk - build/docs/xml/*.xml

setup-docs:
	@.ci/setup docs

lint: configure
	clang-format --dry-run -Werror $(wildcard include/gnomon/*.h solver/*.h solver/*.cpp tests/*.cpp tests/*.h tests/*/*.h tests/*/*.cpp samples/*/*.h samples/*/*.cpp)
	clang-tidy -p build --quiet --warnings-as-errors='*' --extra-arg=-Wno-unknown-warning-option $(wildcard solver/*.cpp)

clean:
	rm -rf build build-asan build-clang build-coverage build-faults build-fuzz build-tsan build-configure.log out
