#!/usr/bin/env bash
# One way of taking the solver, used by a project outside this one: check.sh WAY [COMPILER]. Everything it makes goes to the current
# folder. From ctest: GNOMON_SOURCE and GNOMON_BUILD (the repository and its build), GLM (the folder of GLM's config), and REFERENCE,
# main.cpp linked inside the build, whose output each consumer's must equal.
set -euo pipefail

way=$1 compiler=${2:-g++}
here=$GNOMON_SOURCE/tests/package
strict=(-std=c++20 -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror)
prefix=$PWD/prefix  # where `install` leaves the package
out=$PWD/$way-$compiler
rm -rf "$out"
mkdir -p "$out"

# The consumer must print what the same program prints inside the build.
compare() {
  "$REFERENCE" >"$out/expected"
  "$1" >"$out/printed"
  grep -q texels "$out/expected"
  cmp "$out/expected" "$out/printed"
}

# configure SOURCE BUILD ARGUMENT...: quietly, unless it fails.
configure() {
  cmake -G Ninja -S "$1" -B "$2" -DCMAKE_CXX_COMPILER="$compiler" -Dglm_DIR="$GLM" "${@:3}" >"$out/log" 2>&1 || { cat "$out/log" >&2; exit 1; }
  if grep -i -A5 'warning' "$out/log"; then exit 1; fi
}

copy() {  # what a user copies: no samples, no tests
  mkdir "$out/copy"
  cp -r "$GNOMON_SOURCE"/{CMakeLists.txt,LICENSE,include,solver,glsl} "$out/copy"
}

case $way in
install)  # installed in one place and moved to another
  cmake --install "$GNOMON_BUILD" --prefix "$out/prefix" >/dev/null
  rm -rf "$prefix"
  mv "$out/prefix" "$prefix"
  if grep -rl "$GNOMON_SOURCE\|$out" "$prefix"; then echo "these name the place they were made in"; exit 1; fi
  ;;
find_package)
  configure "$here/installed" "$out/build" -DCMAKE_PREFIX_PATH="$prefix" -DCHECKS=ON
  cmake --build "$out/build"
  compare "$out/build/consumer"
  ctest --test-dir "$out/build" --output-on-failure --no-tests=error
  ;;
pkg_config)
  PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name gnomon.pc)")
  export PKG_CONFIG_PATH
  test -f "$(pkg-config --variable=glsldir gnomon)/gnomon.glsl"
  read -ra flags <<<"$(pkg-config --cflags --libs gnomon)"
  "$compiler" "${strict[@]}" "$here/main.cpp" "${flags[@]}" -o "$out/consumer"
  compare "$out/consumer"
  ;;
subproject)
  copy
  configure "$here/subproject" "$out/build" -DGNOMON_COPY="$out/copy" -DCMAKE_CXX_FLAGS="${strict[*]}"
  cmake --build "$out/build"
  compare "$out/build/consumer"
  ;;
shared)
  copy
  configure "$out/copy" "$out/build" -DBUILD_SHARED_LIBS=ON -DGNOMON_BUILD_SAMPLES=OFF -DGNOMON_BUILD_TESTS=OFF
  cmake --build "$out/build"
  cmake --install "$out/build" --prefix "$out/prefix" >/dev/null
  configure "$here/installed" "$out/consumer" -DCMAKE_PREFIX_PATH="$out/prefix"
  cmake --build "$out/consumer"
  compare "$out/consumer/consumer"
  # It exports every function with external linkage in solver/, all of them in public headers, and nothing else.
  nm -C -D --defined-only "$out/build/libgnomon.so" | cut -c18- | sort >"$out/exported"
  nm -C -g --defined-only "$GNOMON_BUILD/libgnomon.a" | grep '^[0-9a-f]\+ [TRDB] ' | cut -c18- | sort >"$out/public"
  grep -q 'T gnomon::solvePssm(' "$out/exported"
  diff "$out/public" "$out/exported"
  ;;
amalgamation)
  files=$prefix/share/gnomon/amalgamation
  "$compiler" "${strict[@]}" -DONE_FILE -I"$files" "$here/main.cpp" "$files/gnomon.cpp" -o "$out/consumer"
  compare "$out/consumer"
  ;;
amalgamation_clash)  # a private name that another file has too, or a header, is refused by name
  copy
  for name in pixelsOf selectByViewDepth; do
    printf 'namespace gnomon {\nnamespace {\n\ndouble %s(int i) { return i; }\n\n}  // namespace\n}  // namespace gnomon\n' $name |
      tee -a "$out/copy/solver/fit.cpp" >>"$out/copy/solver/split.cpp"
    if cmake -D SOURCE="$out/copy" -D OUTPUT="$out" -D VERSION=0 -P "$out/copy/solver/package/amalgamate.cmake" 2>"$out/log"; then exit 1; fi
    grep "'$name'" "$out/log"
    cp "$GNOMON_SOURCE"/solver/{fit,split}.cpp "$out/copy/solver"
  done
  ;;
headers)  # each compiles alone, and twice
  for header in "$GNOMON_SOURCE"/include/gnomon/*.h; do
    name=gnomon/$(basename "$header")
    printf '#include "%s"\n#include "%s"\n' "$name" "$name" >"$out/$(basename "$header").cpp"
  done
  "$compiler" "${strict[@]}" -fsyntax-only -I"$GNOMON_SOURCE/include" -I"$GNOMON_SOURCE/glsl" "$out"/*.cpp
  ;;
*)
  echo "check.sh: no way '$way'" >&2
  exit 2
  ;;
esac
