#!/usr/bin/env bash
# Makes the films of README and of the tasks' pages, docs/src/pictures/TASK.webp: each of the benchmark's tasks, played by its expert,
# in four seconds. `docs/films.sh [TANDEM]`, where TANDEM is the program; by default, the one that `cargo build --release` makes.
set -euo pipefail
cd "$(dirname "$0")/.."
tandem=${1:-target/release/tandem}
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

"$tandem" evaluate --policy expert --tasks all --protocol benchmark --seeds 2000 --record --out "$runs/films"
for folder in "$runs"/films/episodes/*-2000/; do
    task=$(basename "$folder" -2000)
    film=docs/src/pictures/$task.webp
    steps=$(sed -n 's/.*"env_steps": *\([0-9]*\).*/\1/p' "$folder/result.json")
    # 37 to 65 images of an episode of any length.
    "$tandem" replay "$folder" --video "$film" --rate $(((1799 + steps) / steps)) --seconds 4 --size 384x288
    [ "$(wc -c <"$film")" -le 300000 ] || { echo "$film has more than 300 kB" >&2; exit 1; }
done
