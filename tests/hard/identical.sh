#!/usr/bin/env bash
# Compiles the one-file solver otherwise and compares its answers to hard cases with the build's: the same to the bit.
# identical.sh COMPILER LEVEL ANSWERS CASES GNOMON_CPP OBJECT.. ; ANSWERS: the build's program, OBJECT: what it is made of beside the solver
set -euo pipefail
compiler=$1 level=$2 answers=$3 cases=$4 solver=$5
shift 5
if ! command -v "$compiler" >/dev/null; then
  echo "skipped: no $compiler"
  exit 77
fi
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
"$compiler" -std=c++20 "$level" -ffp-contract=off -fno-math-errno -c "$solver" -o "$out/gnomon.o"
# First, so that functions that both have are the solver's.
"$compiler" "$out/gnomon.o" "$@" -pthread -o "$out/otherwise"
"$answers" "$cases" >"$out/built.txt"
"$out/otherwise" "$cases" >"$out/otherwise.txt"
[ -s "$out/built.txt" ]
diff "$out/built.txt" "$out/otherwise.txt" >"$out/diff" || { head -20 "$out/diff"; echo "$compiler $level answers otherwise"; exit 1; }
echo "$(wc -l <"$out/built.txt") answers alike"
