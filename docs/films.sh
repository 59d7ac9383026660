#!/usr/bin/env bash
# Makes the films of README and of the tasks' pages, docs/src/pictures/TASK.webp: each built-in task, played by its expert, in four
# seconds. `docs/films.sh [TANDEM [TASKS]]`, where TANDEM is the program; by default, the one that `cargo build --release` makes.
set -euo pipefail
cd "$(dirname "$0")/.."
tandem=${1:-target/release/tandem}
tasks=${2:-all tandem+}
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

for suite in $tasks; do
    "$tandem" evaluate --policy expert --tasks "$suite" --protocol benchmark --seeds 2000 --record --out "$runs/$suite"
done
for folder in "$runs"/*/episodes/*-2000/; do
    task=$(basename "$folder" -2000)
    film=docs/src/pictures/$task.webp
    steps=$(sed -n 's/.*"env_steps": *\([0-9]*\).*/\1/p' "$folder/result.json")
    # 37 to 79 images of an episode of any length.
    "$tandem" replay "$folder" --video "$film" --rate $(((1799 + steps) / steps)) --seconds 4 --size 384x288
    [ "$(wc -c <"$film")" -le 320000 ] || { echo "$film has more than 320 kB" >&2; exit 1; }
done
